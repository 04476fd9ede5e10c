# SPDX-License-Identifier: Apache-2.0
# Every dependency is a Debian package; scripts/packages.sh lists them.
find_package(Threads REQUIRED)
find_package(Imath REQUIRED)
find_package(OpenImageIO REQUIRED)
# Debian's OpenImageIO names OpenCV's headers, which nothing here needs, even where they are not installed.
get_target_property(oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
list(FILTER oiio_includes EXCLUDE REGEX "opencv")
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${oiio_includes}")
find_package(embree 3.13 REQUIRED)
find_package(TBB REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(CLI11 REQUIRED)

message(STATUS "Dapple ${PROJECT_VERSION} (${CMAKE_BUILD_TYPE}), dependencies:")
foreach(package Imath OpenImageIO embree TBB spdlog nlohmann_json ZLIB Eigen3 CLI11)
  message(STATUS "  ${package} ${${package}_VERSION}")
endforeach()
