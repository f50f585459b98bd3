# SPDX-License-Identifier: GPL-3.0-or-later
# The installed tree: bin/fibrolite, libexec/fibrolite/ with the programs that run beside it, share/fibrolite/assets, the two libraries with their headers,
# lib/cmake/fibrolite for find_package(fibrolite), and lib/pkgconfig/fibrolite.pc. Targets: fibrolite::engine, fibrolite::ops, and fibrolite::fibrolite for both.
include(CMakePackageConfigHelpers)

set(fibrolite_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fibrolite)

install(TARGETS fibrolite RUNTIME)
install(TARGETS fibrolite-decode fibrolite-tetgen RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/fibrolite)
install(DIRECTORY assets/models assets/recipes assets/textures DESTINATION ${CMAKE_INSTALL_DATADIR}/fibrolite/assets)
install(DIRECTORY LICENSES/ DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/fibrolite)

install(TARGETS fibrolite_all fibrolite_engine fibrolite_ops EXPORT fibrolite ARCHIVE FILE_SET HEADERS)
install(EXPORT fibrolite NAMESPACE fibrolite:: DESTINATION ${fibrolite_config_dir} FILE fibroliteTargets.cmake)

configure_package_config_file(cmake/fibroliteConfig.cmake.in fibroliteConfig.cmake INSTALL_DESTINATION ${fibrolite_config_dir})
# Below 1.0 a minor version may break its users.
write_basic_package_version_file(fibroliteConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/fibroliteConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/fibroliteConfigVersion.cmake
              cmake/dependencies.cmake DESTINATION ${fibrolite_config_dir})

# pkg-config, for those who build without CMake. Relative to itself, so that the tree may be moved.
set(fibrolite_pc_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH fibrolite_pc_to_prefix /${fibrolite_pc_dir} /)
string(REGEX REPLACE "/$" "" fibrolite_pc_to_prefix ${fibrolite_pc_to_prefix})
set(fibrolite_pc_libs "")
foreach(target OpenVDB::openvdb OpenVDB::half lib3mf::lib3mf GMP::mpfr GMP::gmp PNG::PNG OpenCV::imgproc OpenCV::core
               SuiteSparse::cholmod OpenBLAS::openblas)
  get_target_property(library ${target} IMPORTED_LOCATION)
  cmake_path(GET library PARENT_PATH folder)
  cmake_path(GET library STEM LAST_ONLY name)
  string(REGEX REPLACE "^lib" "" name ${name})
  if(NOT folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES AND NOT folder IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
    string(APPEND fibrolite_pc_libs " -L${folder}")
  endif()
  string(APPEND fibrolite_pc_libs " -l${name}")
endforeach()
string(APPEND fibrolite_pc_libs " -ltbb -lz")
configure_file(cmake/fibrolite.pc.in fibrolite.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/fibrolite.pc DESTINATION ${fibrolite_pc_dir})
