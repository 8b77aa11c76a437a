# A scene costs what it needs (tests/scenes/needs.py).
foreach(group scenes fields)
  add_test(NAME needs.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/scenes/needs.py ${group} $<TARGET_FILE:dlmfd>)
  set_tests_properties(needs.${group} PROPERTIES LABELS scenes PROCESSORS 2 TIMEOUT 600)
endforeach()
