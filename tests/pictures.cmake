# Pictures and pages that tools/ make of short runs (tests/pictures/run.py). The browser test needs Chromium, which tools/setup installs.
foreach(group tools errors browser)
  add_test(NAME pictures.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/pictures/run.py ${group} $<TARGET_FILE:dlmfd>)
  set_tests_properties(pictures.${group} PROPERTIES LABELS pictures TIMEOUT 900)
endforeach()
add_test(NAME pictures.reference COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/pictures/reference.py)
set_tests_properties(pictures.reference PROPERTIES LABELS pictures)
