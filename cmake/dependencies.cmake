# SPDX-License-Identifier: Apache-2.0
# Every dependency is a Debian package; scripts/packages.sh lists them. cmake/dappleConfig.cmake.in finds the same for users of
# the installed libraries.

# dapple_find_quietly(package ...): find_package(package REQUIRED ...) without the package's own chatter. Debian's CMake files of Imath
# and OpenImageIO also name tools and Python bindings of other packages, and tell at length that these are absent.
macro(dapple_find_quietly)
  set(dapple_log_level ${CMAKE_MESSAGE_LOG_LEVEL})
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
  find_package(${ARGN} REQUIRED)
  set(CMAKE_MESSAGE_LOG_LEVEL ${dapple_log_level})
endmacro()

find_package(Threads REQUIRED)
dapple_find_quietly(Imath 3.1)
dapple_find_quietly(OpenImageIO 2.4)
# Debian's OpenImageIO names OpenCV's headers, which nothing here needs, even where they are not installed.
get_target_property(oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER oiio_includes EXCLUDE REGEX "opencv")
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${oiio_includes}")
dapple_find_quietly(OpenSubdiv 3.5)
dapple_find_quietly(embree 3.13)
dapple_find_quietly(TBB)
dapple_find_quietly(spdlog)
dapple_find_quietly(nlohmann_json)
dapple_find_quietly(ZLIB)
dapple_find_quietly(Eigen3)
dapple_find_quietly(CLI11)
set(ZLIB_VERSION ${ZLIB_VERSION_STRING})

message(STATUS "Dapple ${PROJECT_VERSION} (${CMAKE_BUILD_TYPE}, ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}), dependencies:")
foreach(package Imath OpenImageIO OpenSubdiv embree TBB spdlog nlohmann_json ZLIB Eigen3 CLI11)
  message(STATUS "  ${package} ${${package}_VERSION}")
endforeach()
