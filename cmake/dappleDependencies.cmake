# SPDX-License-Identifier: Apache-2.0
# The packages that Dapple's libraries use: found here for the build, and (this file is installed) for whoever uses them
# installed. Every one is a Debian package; scripts/packages.sh lists them. dapple_find_options is REQUIRED or empty.

# dapple_find(package ...): find_package without the package's own chatter. Debian's CMake files of Imath and OpenImageIO also name
# Python bindings and tools of other packages, and tell at length that these are absent.
macro(dapple_find)
  set(dapple_log_level ${CMAKE_MESSAGE_LOG_LEVEL})
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
  find_package(${ARGN} ${dapple_find_options})
  set(CMAKE_MESSAGE_LOG_LEVEL ${dapple_log_level})
endmacro()

list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})  # FindBlosc.cmake, FindOpenSubdiv.cmake, FindoneDNN.cmake
set(dapple_packages Imath OpenImageIO OpenSubdiv embree TBB spdlog nlohmann_json ZLIB Eigen3 oneDNN assimp Blosc)
find_package(Threads ${dapple_find_options})
dapple_find(Imath 3.1)
dapple_find(OpenImageIO 2.4)
dapple_find(OpenSubdiv 3.5)
dapple_find(embree 3.13)
dapple_find(TBB)
dapple_find(spdlog)
dapple_find(nlohmann_json)
dapple_find(ZLIB)
dapple_find(Eigen3)
dapple_find(oneDNN 2.6)
dapple_find(assimp 5.2)
dapple_find(Blosc 1.21)

# Debian's OpenImageIO names OpenCV's headers, which nothing here needs, even where they are not installed.
if(OpenImageIO_FOUND)
  get_target_property(dapple_oiio_includes OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
  list(FILTER dapple_oiio_includes EXCLUDE REGEX "opencv")
  set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${dapple_oiio_includes}")
endif()
