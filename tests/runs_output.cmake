# What a run leaves, against exact values: the stress of the suspension in bulk.csv (tests/scenes/bulk.py), the fields as VTK's own readers read them.
foreach(group exact balance forces dilute stresslet)
  add_test(NAME bulk.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/bulk.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(bulk.${group} PROPERTIES LABELS "scenes;verification" TIMEOUT 900)
endforeach()
set_tests_properties(bulk.balance PROPERTIES PROCESSORS 3)

add_test(NAME scenes.vtk COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/read_vtk.py $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
set_tests_properties(scenes.vtk PROPERTIES LABELS scenes PROCESSORS 3 TIMEOUT 900)

add_test(NAME scenes.progress COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/progress.py $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
set_tests_properties(scenes.progress PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 300)
