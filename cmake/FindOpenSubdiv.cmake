# SPDX-License-Identifier: Apache-2.0
# Finds OpenSubdiv's headers and shared library; defines OpenSubdiv::osdCPU. In place of OpenSubdiv's own CMake file, because
# Debian's copy of that demands static libraries which no package holds.
find_path(OpenSubdiv_INCLUDE_DIR opensubdiv/version.h)
find_library(OpenSubdiv_LIBRARY osdCPU)

if(OpenSubdiv_INCLUDE_DIR)
  file(STRINGS ${OpenSubdiv_INCLUDE_DIR}/opensubdiv/version.h line REGEX "define OPENSUBDIV_VERSION_NUMBER")
  if(line MATCHES "([0-9]+)([0-9][0-9])([0-9][0-9])$")
    math(EXPR minor "${CMAKE_MATCH_2}")
    math(EXPR patch "${CMAKE_MATCH_3}")
    set(OpenSubdiv_VERSION ${CMAKE_MATCH_1}.${minor}.${patch})
  endif()
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenSubdiv REQUIRED_VARS OpenSubdiv_LIBRARY OpenSubdiv_INCLUDE_DIR
  VERSION_VAR OpenSubdiv_VERSION)
mark_as_advanced(OpenSubdiv_INCLUDE_DIR OpenSubdiv_LIBRARY)

if(OpenSubdiv_FOUND AND NOT TARGET OpenSubdiv::osdCPU)
  add_library(OpenSubdiv::osdCPU SHARED IMPORTED)
  set_target_properties(OpenSubdiv::osdCPU PROPERTIES IMPORTED_LOCATION ${OpenSubdiv_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OpenSubdiv_INCLUDE_DIR})
endif()
