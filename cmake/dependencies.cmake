# SPDX-License-Identifier: Apache-2.0
set(dapple_find_options REQUIRED)
include(cmake/dappleDependencies.cmake)
dapple_find(CLI11)  # the command line only
set(ZLIB_VERSION ${ZLIB_VERSION_STRING})

message(STATUS "Dapple ${PROJECT_VERSION} (${CMAKE_BUILD_TYPE}, ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}), dependencies:")
foreach(package ${dapple_packages} CLI11)
  message(STATUS "  ${package} ${${package}_VERSION}")
endforeach()
