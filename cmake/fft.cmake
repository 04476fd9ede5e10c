# SPDX-License-Identifier: Apache-2.0
# Products of complex numbers without a second look for infinities, which a sum of transmittances has not: the transforms take half the time.
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag(-fcx-limited-range DAPPLE_HAS_LIMITED_RANGE)
if(DAPPLE_HAS_LIMITED_RANGE)
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/dapple/numeric/fft.cpp PROPERTIES COMPILE_OPTIONS "-fcx-limited-range")
endif()
