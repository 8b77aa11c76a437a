# Viscoelastic flows against exact solutions, and spheres in them (tests/scenes/viscoelastic.py, viscoelastic_spheres.py).
foreach(group startup poiseuille mode carreau)
  add_test(NAME viscoelastic.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/viscoelastic.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(viscoelastic.${group} PROPERTIES LABELS verification TIMEOUT 900)
endforeach()

foreach(group rotation small_wi start ranks symmetry health)
  add_test(NAME viscoelastic.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/viscoelastic_spheres.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(viscoelastic.${group} PROPERTIES LABELS scenes TIMEOUT 900)
endforeach()
set_tests_properties(viscoelastic.ranks PROPERTIES PROCESSORS 4)

# The measurement of error against cost, on the smallest case (tests/scenes/tradeoff.py).
add_test(NAME scenes.tradeoff COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/tradeoff.py $<TARGET_FILE:dlmfd>)
set_tests_properties(scenes.tradeoff PROPERTIES LABELS scenes TIMEOUT 300)

# Presets of -accuracy (tests/scenes/presets.py).
foreach(group short foretold long)
  add_test(NAME scenes.presets_${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/presets.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(scenes.presets_${group} PROPERTIES LABELS scenes TIMEOUT 900)
endforeach()
set_tests_properties(scenes.presets_long PROPERTIES LABELS "scenes;long")
