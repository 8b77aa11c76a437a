# Scenes that must not depend on ranks, on the periodic face, on the frame of the walls or on the solver; orders of the splitting.
foreach(group ranks crossing walls outputs adapt)
  add_test(NAME scenes.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/run_scenes.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(scenes.${group} PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 900)
endforeach()
set_tests_properties(scenes.ranks PROPERTIES PROCESSORS 4)
set_tests_properties(scenes.walls scenes.adapt PROPERTIES PROCESSORS 1) # one rank, or nearly always

# Half of a box that is its own mirror image (tests/scenes/mirror.py).
foreach(group flows ranks solvers restart rules)
  add_test(NAME mirror.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/mirror.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(mirror.${group} PROPERTIES LABELS scenes TIMEOUT 900)
endforeach()
set_tests_properties(mirror.ranks PROPERTIES PROCESSORS 4)
set_tests_properties(mirror.restart PROPERTIES PROCESSORS 2)

add_test(NAME scenes.solvers COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/solvers.py $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
set_tests_properties(scenes.solvers PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 900)

add_test(NAME verify.splitting COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/verification/verify_splitting.py $<TARGET_FILE:dlmfd>)
set_tests_properties(verify.splitting PROPERTIES LABELS verification TIMEOUT 900)
