# What `dlmfd -version` tells: dlmbuild.h from the configuration, dlmcommit.h anew at every build.
string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
set(DLM_FLAGS "${CMAKE_C_FLAGS} ${CMAKE_C_FLAGS_${type}}")
if(DLM_NATIVE)
  string(APPEND DLM_FLAGS " -march=native")
endif()
if(DLM_SANITIZE AND CMAKE_BUILD_TYPE STREQUAL "Debug")
  string(APPEND DLM_FLAGS " -fsanitize=address,undefined")
endif()
string(STRIP "${DLM_FLAGS}" DLM_FLAGS)
string(REGEX REPLACE "([\"\\])" "\\\\\\1" DLM_FLAGS "${DLM_FLAGS}")
configure_file(${CMAKE_CURRENT_LIST_DIR}/dlmbuild.h.in ${PROJECT_BINARY_DIR}/version/dlmbuild.h @ONLY)

add_custom_target(dlmfd_commit BYPRODUCTS ${PROJECT_BINARY_DIR}/version/dlmcommit.h
                  COMMAND ${CMAKE_COMMAND} -D SOURCE=${PROJECT_SOURCE_DIR} -D OUTPUT=${PROJECT_BINARY_DIR}/version/dlmcommit.h
                          -P ${CMAKE_CURRENT_LIST_DIR}/commit.cmake)
target_include_directories(dlmfd_lib PRIVATE ${PROJECT_BINARY_DIR}/version)
add_dependencies(dlmfd_lib dlmfd_commit)
