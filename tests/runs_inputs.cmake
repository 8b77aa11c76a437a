# The scenes of input/, run as their users run them, and single solves against exact values (tests/scenes/inputs.py).
add_test(NAME scenes.inputs COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/inputs.py run $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
set_tests_properties(scenes.inputs PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 600)

foreach(group frames rotation rotation_tall off_centre settling settling_cells)
  add_test(NAME verify.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/inputs.py ${group} $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
  set_tests_properties(verify.${group} PROPERTIES LABELS verification TIMEOUT 900)
endforeach()
set_tests_properties(verify.frames PROPERTIES PROCESSORS 2)

# Tall and other boxes take minutes.
set_tests_properties(verify.rotation_tall verify.settling_cells PROPERTIES LABELS "verification;long")
