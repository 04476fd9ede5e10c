# SPDX-License-Identifier: Apache-2.0
# The kernels of pattern programs are compiled for several instruction sets, of which the program takes the best that the
# machine has, whatever DAPPLE_ISA says. All give the same bits.
set(kernel_files ${PROJECT_SOURCE_DIR}/src/dapple/pattern/pattern_kernels)
# Clang 14, of the preset fuzz, cannot ask for these levels.
include(CheckCXXSourceCompiles)
check_cxx_source_compiles("int main() { return __builtin_cpu_supports(\"x86-64-v4\"); }" DAPPLE_ASKS_X86_LEVELS)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND DAPPLE_ASKS_X86_LEVELS)
  set_source_files_properties(${kernel_files}.cpp ${kernel_files}_v3.cpp ${kernel_files}_v4.cpp PROPERTIES
    COMPILE_DEFINITIONS DAPPLE_KERNELS_X86)
  set_source_files_properties(${kernel_files}_v3.cpp PROPERTIES COMPILE_OPTIONS "-march=x86-64-v3")
  set_source_files_properties(${kernel_files}_v4.cpp PROPERTIES COMPILE_OPTIONS "-march=x86-64-v4;-mprefer-vector-width=512")
endif()
