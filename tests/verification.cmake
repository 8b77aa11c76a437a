# dlm_verification(<name> <ranks>): builds tests/verification/verify_<name>.c; it fails where a measured order falls short.
function(dlm_verification name ranks)
  add_executable(verify_${name} verification/verify_${name}.c)
  target_link_libraries(verify_${name} PRIVATE dlmfd_lib)
  add_test(NAME verify.${name} COMMAND ${DLM_MPIRUN} -n ${ranks} $<TARGET_FILE:verify_${name}>)
  set_tests_properties(verify.${name} PROPERTIES LABELS verification PROCESSORS ${ranks} TIMEOUT 120)
endfunction()

dlm_verification(stokes 2)
