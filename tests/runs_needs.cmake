# A scene costs what it needs, and -dry_run foretells it (tests/scenes/needs.py, dryrun.py).
foreach(group scenes fields)
  add_test(NAME needs.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/needs.py ${group} $<TARGET_FILE:dlmfd>)
  set_tests_properties(needs.${group} PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 600)
endforeach()

add_test(NAME needs.dryrun COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/dryrun.py $<TARGET_FILE:dlmfd> ${DLM_MPIRUN})
set_tests_properties(needs.dryrun PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 600)
