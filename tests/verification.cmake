# dlm_verification(<name> <ranks>): builds tests/verification/verify_<name>.c; it fails where a measured order falls short.
function(dlm_verification name ranks)
  add_executable(verify_${name} verification/verify_${name}.c)
  target_link_libraries(verify_${name} PRIVATE dlmfd_lib)
  add_test(NAME verify.${name} COMMAND ${DLM_MPIRUN} -n ${ranks} $<TARGET_FILE:verify_${name}>)
  set_tests_properties(verify.${name} PROPERTIES LABELS verification PROCESSORS ${ranks} TIMEOUT 120)
endfunction()

dlm_verification(stokes 2)

# Close pairs: the exact series against published values, and the program's pair against the series.
foreach(what exact mobility)
  add_test(NAME verify.close_pairs.${what} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/verification/verify_close_pairs.py ${PROJECT_SOURCE_DIR}
           $<TARGET_FILE:dlmfd_close_pairs> ${what})
  set_tests_properties(verify.close_pairs.${what} PROPERTIES LABELS verification TIMEOUT 300)
endforeach()

# Pairs that pass at a gap of thousandths of a radius.
foreach(fluid newtonian oldroydb)
  add_test(NAME verify.close_pairs.passing_${fluid} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/verification/verify_passing.py ${fluid} $<TARGET_FILE:dlmfd> ${PROJECT_SOURCE_DIR})
  set_tests_properties(verify.close_pairs.passing_${fluid} PROPERTIES LABELS long TIMEOUT 3600)
endforeach()
