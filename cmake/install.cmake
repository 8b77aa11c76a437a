# What `cmake --install` and `cpack -G DEB` (tools/package) put where. docs/developer.md, "Releases", says why.
include(GNUInstallDirs)
set(share ${CMAKE_INSTALL_DATADIR}/dlmfd)
set(made ${PROJECT_BINARY_DIR}/install) # files made here to be installed

# Tools of users: installed under their names in ${share}/tools, with the modules and tables they read, and linked as dlmfd-NAME.
file(GLOB DLM_TOOLS CONFIGURE_DEPENDS tools/plot_* tools/movie tools/report)
file(GLOB DLM_MODULES CONFIGURE_DEPENDS tools/dlm*.py tools/*.csv)

# compressed(<file>): ${made}/<file>.gz without its time, so that the same source gives the same package.
find_program(DLM_GZIP gzip REQUIRED)
function(compressed name)
  execute_process(COMMAND ${DLM_GZIP} -9nc ${name} WORKING_DIRECTORY ${made} OUTPUT_FILE ${made}/${name}.gz COMMAND_ERROR_IS_FATAL ANY)
endfunction()
# link(<name> <target> <folder>): a symbolic link <folder>/<name>, relative as the target is.
function(link name target folder)
  file(CREATE_LINK ${target} ${made}/${name} SYMBOLIC)
  install(FILES ${made}/${name} DESTINATION ${folder})
endfunction()

include(cmake/manpage.cmake)
configure_file(CHANGELOG ${made}/changelog COPYONLY)
compressed(changelog)
compressed(dlmfd.1)

install(TARGETS dlmfd dlmfd_lib RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dlmfd PATTERN private EXCLUDE)
install(DIRECTORY input DESTINATION ${share})
install(PROGRAMS ${DLM_TOOLS} DESTINATION ${share}/tools)
install(FILES ${DLM_MODULES} DESTINATION ${share}/tools)
install(FILES README.md ${made}/changelog.gz DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN *.in EXCLUDE)
install(FILES ${made}/dlmfd.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)

file(RELATIVE_PATH up /${CMAKE_INSTALL_DOCDIR} /${share})
link(examples ${up}/input ${CMAKE_INSTALL_DOCDIR})
file(RELATIVE_PATH up /${CMAKE_INSTALL_BINDIR} /${share})
foreach(tool ${DLM_TOOLS})
  get_filename_component(tool ${tool} NAME)
  string(REPLACE _ - command dlmfd-${tool})
  link(${command} ${up}/tools/${tool} ${CMAKE_INSTALL_BINDIR})
  link(${command}.1.gz dlmfd.1.gz ${CMAKE_INSTALL_MANDIR}/man1)
endforeach()

# pkg-config: the prefix follows from where the file lies, so the tree may be installed or moved anywhere.
file(RELATIVE_PATH DLM_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(DLM_LIBRARIES "")
foreach(library ${DLM_PLAIN_LIBRARIES})
  get_filename_component(folder ${library} DIRECTORY)
  get_filename_component(name ${library} NAME_WE)
  string(REGEX REPLACE "^lib" "-l" name ${name})
  if(NOT folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES)
    string(APPEND DLM_LIBRARIES " -L${folder}")
  endif()
  string(APPEND DLM_LIBRARIES " ${name}")
endforeach()
if(DLM_SANITIZE AND CMAKE_BUILD_TYPE STREQUAL "Debug")
  string(APPEND DLM_LIBRARIES " -fsanitize=address,undefined")
endif()
configure_file(cmake/dlmfd.pc.in ${made}/dlmfd.pc @ONLY)
install(FILES ${made}/dlmfd.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

include(cmake/package.cmake)
