// SPDX-License-Identifier: Apache-2.0
#define DAPPLE_KERNELS baseline_pattern_kernels
#include "dapple/pattern/pattern_kernels.inl"

namespace dapple::pattern {

#ifdef DAPPLE_KERNELS_X86
const PatternKernels& v3_pattern_kernels();
const PatternKernels& v4_pattern_kernels();
#endif

const PatternKernels& native_pattern_kernels() {
#ifdef DAPPLE_KERNELS_X86
  static const PatternKernels& fastest = __builtin_cpu_supports("x86-64-v4")   ? v4_pattern_kernels()
                                         : __builtin_cpu_supports("x86-64-v3") ? v3_pattern_kernels()
                                                                               : baseline_pattern_kernels();
  return fastest;
#else
  return baseline_pattern_kernels();
#endif
}

}  // namespace dapple::pattern
