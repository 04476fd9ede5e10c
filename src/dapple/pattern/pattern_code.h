// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dapple/pattern/pattern_graph.h"

namespace dapple::pattern {

/// Patterns as PatternCompiler leaves them and PatternProgram runs them: instructions over registers, which lie one
/// after another in memory, and what they read beside.
struct PatternCode {
  /// What an operand's offset counts from.
  enum class Base : uint32_t { registers, inputs, constants, batch };
  /// Base in the upper two bits, offset in the others: in floats, of registers in registers.
  using Operand = uint32_t;
  static Operand operand(Base base, size_t offset) {
    return static_cast<uint32_t>(base) << 30 | static_cast<uint32_t>(offset);
  }
  static Base base_of(Operand o) { return static_cast<Base>(o >> 30); }
  static uint32_t offset_of(Operand o) { return o & 0x3fffffff; }

  /// Where an image must be looked up: where its last operand is so.
  enum class Guard : uint8_t { none, not_zero, not_one, zero };

  struct Instruction {
    PatternOp op{};
    uint8_t variant = 0;  ///< of a kernel; of an image its Guard
    uint8_t operands = 0, results = 1;
    uint32_t first = 0;       ///< in PatternCode::operands: results, then operands
    uint32_t parameters = 0;  ///< in PatternCode::parameters (floats) or images
  };

  std::vector<Instruction> instructions;
  std::vector<Operand> operands, outputs;
  std::vector<float> constants, parameters;
  std::vector<PatternImage> images;
  std::vector<FloatTexturePtr> foreign_float;  ///< their values come first in the batch's memory, one array each
  std::vector<RgbTexturePtr> foreign_rgb;      ///< then theirs, three arrays each
  int registers = 0;
};

}  // namespace dapple::pattern
