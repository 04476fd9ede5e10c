// SPDX-License-Identifier: Apache-2.0
// Compiled without vector code, see CMakeLists.txt.
#define DAPPLE_KERNELS scalar_pattern_kernels
#include "dapple/pattern/pattern_kernels.inl"
