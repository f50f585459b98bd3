# SPDX-License-Identifier: GPL-3.0-or-later
# The installed tree: bin/fibrolite, libexec/fibrolite/fibrolite-tetgen, share/fibrolite/assets, the two libraries with their headers,
# and lib/cmake/fibrolite for find_package(fibrolite). Targets: fibrolite::engine, fibrolite::ops, and fibrolite::fibrolite for both.
include(CMakePackageConfigHelpers)

set(fibrolite_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fibrolite)

install(TARGETS fibrolite RUNTIME)
install(TARGETS fibrolite-tetgen RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/fibrolite)
install(DIRECTORY assets/models assets/recipes assets/textures DESTINATION ${CMAKE_INSTALL_DATADIR}/fibrolite/assets)
install(DIRECTORY LICENSES/ DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/fibrolite)

install(TARGETS fibrolite_all fibrolite_engine fibrolite_ops EXPORT fibrolite ARCHIVE FILE_SET HEADERS)
install(EXPORT fibrolite NAMESPACE fibrolite:: DESTINATION ${fibrolite_config_dir} FILE fibroliteTargets.cmake)

configure_package_config_file(cmake/fibroliteConfig.cmake.in fibroliteConfig.cmake INSTALL_DESTINATION ${fibrolite_config_dir})
# Below 1.0 a minor version may break its users.
write_basic_package_version_file(fibroliteConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/fibroliteConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/fibroliteConfigVersion.cmake
              cmake/dependencies.cmake DESTINATION ${fibrolite_config_dir})
