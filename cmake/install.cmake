# SPDX-License-Identifier: Apache-2.0
# cmake --install: the program, the libraries with their headers, and a CMake package (cmake/dappleConfig.cmake.in).
include(CMakePackageConfigHelpers)

get_property(libraries GLOBAL PROPERTY DAPPLE_LIBRARIES)
install(TARGETS dapple RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS ${libraries} EXPORT dapple ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/dapple DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(DIRECTORY data/denoise DESTINATION ${CMAKE_INSTALL_DATADIR}/dapple)
install(FILES README.md LICENSE third_party.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/dapple)
install(EXPORT dapple NAMESPACE dapple:: FILE dappleTargets.cmake DESTINATION ${package_folder})
configure_package_config_file(cmake/dappleConfig.cmake.in dappleConfig.cmake INSTALL_DESTINATION ${package_folder}
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(dappleConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dappleConfig.cmake ${PROJECT_BINARY_DIR}/dappleConfigVersion.cmake
  cmake/dappleDependencies.cmake cmake/dapplePlugin.cmake cmake/FindBlosc.cmake cmake/FindOpenSubdiv.cmake cmake/FindoneDNN.cmake DESTINATION ${package_folder})
