# SPDX-License-Identifier: Apache-2.0
# Finds the headers and shared library of C-Blosc, which has no CMake file of its own; defines Blosc::blosc.
find_path(Blosc_INCLUDE_DIR blosc.h)
find_library(Blosc_LIBRARY blosc)

if(Blosc_INCLUDE_DIR)
  file(STRINGS ${Blosc_INCLUDE_DIR}/blosc.h line REGEX "define BLOSC_VERSION_STRING ")
  string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" Blosc_VERSION "${line}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Blosc REQUIRED_VARS Blosc_LIBRARY Blosc_INCLUDE_DIR VERSION_VAR Blosc_VERSION)
mark_as_advanced(Blosc_INCLUDE_DIR Blosc_LIBRARY)

if(Blosc_FOUND AND NOT TARGET Blosc::blosc)
  add_library(Blosc::blosc SHARED IMPORTED)
  set_target_properties(Blosc::blosc PROPERTIES IMPORTED_LOCATION ${Blosc_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${Blosc_INCLUDE_DIR})
endif()
