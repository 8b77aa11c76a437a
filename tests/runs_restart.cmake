# Checkpoints and what may happen to them (tests/restart/run.py), faults (faults.py).
function(dlm_restart name script group)
  add_test(NAME restart.${name} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/restart/${script} ${group} $<TARGET_FILE:dlmfd> ${ARGN} ${DLM_MPIRUN})
  set_tests_properties(restart.${name} PROPERTIES LABELS restart TIMEOUT 900)
endfunction()

foreach(group legs ranks refused signals)
  dlm_restart(${group} run.py ${group})
endforeach()
dlm_restart(disk faults.py disk)
dlm_restart(folder faults.py folder)
dlm_restart(limits faults.py limits)
dlm_restart(kills faults.py kills 8)
dlm_restart(many_kills faults.py kills 120)
set_tests_properties(restart.legs restart.ranks PROPERTIES PROCESSORS 2) # the others wait more than they compute
set_tests_properties(restart.many_kills PROPERTIES LABELS "restart;long")
