// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dapple::pattern {

/// What an instruction of a pattern program does to each lane. Colours are three lanes of float, handled apart;
/// operands and results are floats. Formulas: lane_math.h, noise.h.
enum class PatternOp : uint8_t {
  // Leaves.
  constant,
  input,    ///< an array of ShadingPoints
  foreign,  ///< a Texture that is no program; 1 or 3 results
  // Of one operand.
  absolute,
  floor,
  sqrt,
  exp,
  log,
  sin,
  cos,
  // Of two.
  add,
  subtract,
  multiply,
  divide,
  minimum,
  maximum,
  modulo,
  power,
  atan2,        ///< y, x
  less,         ///< 1 where a < b, else 0
  square_wave,  ///< x, half-width of the filter
  // Of three.
  multiply_add,  ///< a b + c, rounded twice
  select,        ///< where a is not 0: b, else c
  mix,           ///< a (1 - c) + b c
  smoothstep,    ///< low, high, x
  // Kernels with parameters or several results.
  perlin,            ///< x, y, z
  simplex,           ///< x, y, z
  fbm,               ///< x, y, z, squared footprint; parameters: octaves, omega
  turbulence,        ///< the same of absolute values
  left_out_octaves,  ///< squared footprint; parameters: octaves, omega; sum of squared amplitudes left out of fbm
  worley,            ///< x, y, z; parameter: jitter; results: distances F1 and F2, random number of the nearest cell
  ramp,              ///< x; parameters: see PatternRamp; 1 or 3 results
  mean_over,         ///< three operands of another op, spread of one; parameters: op, which operand, the op's own
  deviation_over,    ///< the same
  rgb_to_hsv,
  hsv_to_rgb,
  image,  ///< s, t, ds/dx, dt/dx, ds/dy, dt/dy; 1 or 3 results
};
inline constexpr int pattern_op_count = static_cast<int>(PatternOp::image) + 1;

inline constexpr int max_pattern_operands = 7, max_pattern_results = 3;  // seven: an image's guard

/// Operands of op; results where they do not depend on more.
constexpr int operand_count(PatternOp op) {
  if (op <= PatternOp::foreign) return 0;
  if (op <= PatternOp::cos) return 1;
  if (op <= PatternOp::square_wave) return 2;
  if (op <= PatternOp::simplex) return 3;
  switch (op) {
    case PatternOp::fbm:
    case PatternOp::turbulence:
    case PatternOp::mean_over:
    case PatternOp::deviation_over:
      return 4;
    case PatternOp::ramp:
    case PatternOp::left_out_octaves:
      return 1;
    case PatternOp::image:
      return 6;
    default:
      return 3;
  }
}

/// About how many instructions of the processor an op takes a lane, in full batches (callgrind, AVX2); of fbm and
/// turbulence an octave, of means over another op what comes on top of five times that one.
constexpr float instructions_of(PatternOp op) {
  switch (op) {
    case PatternOp::constant:
    case PatternOp::input:
    case PatternOp::foreign:
      return 0;
    case PatternOp::exp:
    case PatternOp::log:
    case PatternOp::sin:
    case PatternOp::cos:
    case PatternOp::atan2:
    case PatternOp::power:
    case PatternOp::rgb_to_hsv:
    case PatternOp::hsv_to_rgb:
      return 5;
    case PatternOp::perlin:
    case PatternOp::simplex:
    case PatternOp::fbm:
    case PatternOp::turbulence:
    case PatternOp::ramp:
      return 20;
    case PatternOp::mean_over:
    case PatternOp::deviation_over:
      return 12;
    case PatternOp::worley:
      return 300;
    case PatternOp::image:
      return 400;
    default:
      return 1;
  }
}

/// True for what an instruction needs no code for: numbers, and what is in memory before the program runs.
constexpr bool is_leaf(PatternOp op) {
  return op <= PatternOp::foreign;
}

/// True for ops of one result that read each lane once: the result may overwrite an operand, and operands may be
/// numbers.
constexpr bool is_elementwise(PatternOp op) {
  return op >= PatternOp::absolute && op <= PatternOp::smoothstep;
}

/// A kernel's operands and results: arrays of `count` lanes, count a multiple of 8; or one number where the variant
/// says so.
struct PatternCall {
  int count, results;
  const float* in[max_pattern_operands];  // as many as the op has: no time to clear the rest
  float* out[max_pattern_results];
  const float* parameters;
};

/// The code of all ops but foreign and image, for one instruction set. Kernels are pure and give the same bits in every
/// lane and every instruction set.
struct PatternKernels {
  using Kernel = void (*)(const PatternCall&);
  /// Bit i of a variant: operand i is one number for all lanes. Variant 0 exists for every op; others may be null.
  /// `constant` writes the number parameters[0].
  static constexpr int variants = 8;
  std::array<Kernel, pattern_op_count * variants> table{};

  Kernel find(PatternOp op, int variant) const {
    return table[static_cast<size_t>(static_cast<int>(op) * variants + variant)];
  }
};

/// The fastest kernels that this machine can run.
const PatternKernels& native_pattern_kernels();
/// Those of the program's own instruction set.
const PatternKernels& baseline_pattern_kernels();

}  // namespace dapple::pattern
