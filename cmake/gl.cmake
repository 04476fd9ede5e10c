# SPDX-License-Identifier: Apache-2.0
# Graphics hardware is optional: where libepoxy is not found, glimpostor says so when asked.
file(GLOB dapple_gl_sources ${PROJECT_SOURCE_DIR}/src/dapple/glimpostor/*.cpp)
set(dapple_no_gl ${PROJECT_SOURCE_DIR}/src/dapple/glimpostor/no_device.cpp)
list(REMOVE_ITEM dapple_gl_sources ${dapple_no_gl})
if(DAPPLE_GL_LIBRARIES)
  set_source_files_properties(${dapple_no_gl} PROPERTIES HEADER_FILE_ONLY ON)
else()
  set_source_files_properties(${dapple_gl_sources} PROPERTIES HEADER_FILE_ONLY ON)
endif()
