// SPDX-License-Identifier: Apache-2.0
// Compiled for x86-64-v3, see CMakeLists.txt.
#ifdef DAPPLE_KERNELS_X86
#define DAPPLE_KERNELS v3_pattern_kernels
#include "dapple/pattern/pattern_kernels.inl"
#endif
