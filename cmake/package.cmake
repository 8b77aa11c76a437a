# The Debian package. Made by tools/package, which configures for it: a package must run on every processor, so DLM_NATIVE has to be OFF.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME dlmfd)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
    "dlmfd computes the motion of rigid spheres in bounded shear flows of
Newtonian, Oldroyd-B, upper-convected Maxwell and shear-thinning fluids,
without fluid inertia. The fluid fills a box whose axes are periodic or
closed by moving walls; the spheres are imposed on a uniform mesh by
distributed Lagrange multipliers.
.
The package holds the program, which runs under mpirun, tools that plot its
results, example scenes, and the library it is made of (static, with headers).")
string(REGEX REPLACE "^ -- (.*>)  .*" "\\1" CPACK_DEBIAN_PACKAGE_MAINTAINER "${date}")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "openmpi-bin, python3")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libopenblas0-serial, python3-h5py, python3-matplotlib, python3-numpy")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "ffmpeg, libfftw3-dev, libhdf5-openmpi-dev, liblapack-dev, libmetis-dev, libyaml-dev, petsc-dev, pkg-config")

# Of the static library CMake strips nothing by itself.
install(CODE "
  if(CMAKE_INSTALL_DO_STRIP)
    execute_process(COMMAND ${CMAKE_STRIP} --strip-debug --strip-unneeded \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/libdlmfd.a
                    COMMAND_ERROR_IS_FATAL ANY)
  endif()")
set(CPACK_DLM_NATIVE ${DLM_NATIVE})
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/portable.cmake)
include(CPack)
