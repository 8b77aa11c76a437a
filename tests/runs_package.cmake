# What is installed and packed, and what the program tells about itself (tests/package/run.py).
foreach(group version commit install deb)
  add_test(NAME package.${group} COMMAND ${DLM_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/package/run.py ${group} ${PROJECT_BINARY_DIR} ${DLM_MPIRUN})
  set_tests_properties(package.${group} PROPERTIES LABELS package TIMEOUT 600 PROCESSORS 2 SKIP_RETURN_CODE 77)
endforeach()
