# Checkpoints and what may happen to them (tests/restart/run.py).
function(dlm_restart name group)
  add_test(NAME restart.${name} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/restart/run.py ${group} $<TARGET_FILE:dlmfd> ${ARGN} ${DLM_MPIRUN})
  set_tests_properties(restart.${name} PROPERTIES LABELS restart TIMEOUT 900)
endfunction()

foreach(group legs ranks refused signals)
  dlm_restart(${group} ${group})
endforeach()
dlm_restart(kills kills 5)
dlm_restart(many_kills kills 60)
set_tests_properties(restart.legs restart.ranks restart.signals PROPERTIES PROCESSORS 2)
set_tests_properties(restart.many_kills PROPERTIES LABELS "restart;long")
