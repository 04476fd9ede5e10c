// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/pattern/pattern_value.h"

namespace dapple::pattern {

/// Patterns as a flat list of instructions over registers of lanes, run over batches of points: one dispatch an
/// instruction and batch, vector code inside. Several patterns of one graph may be outputs of one program, which
/// computes what they share once. Holds no reference to the graph. Immutable, thread-safe, re-entrant; evaluation takes
/// no locks, and no memory beyond 64 KiB of stack unless more than 2000 values are alive at once.
///
/// Each lane's values depend on that lane's point only and are the same to the last bit for any batch.
class PatternProgram {
 public:
  /// Where an output goes: data[i * stride] for point i.
  struct Output {
    float* data;
    int stride = 1;
  };

  explicit PatternProgram(std::span<const PatternFloat> outputs, int most_lanes = ShadingPoints::capacity);

  /// Writes each output for points [0, points.count).
  void evaluate(const ShadingPoints& points, std::span<const Output> outputs,
                const PatternKernels& kernels = native_pattern_kernels()) const;

  size_t instruction_count() const { return instructions_.size(); }
  float work() const;  ///< Texture::work
  int register_count() const { return registers_; }
  int lanes() const { return lanes_; }  ///< points that one pass over the instructions treats

 private:
  friend class PatternCompiler;

  /// What an operand's offset, in floats, counts from.
  enum class Base : uint32_t { registers, inputs, constants, batch };
  /// Base in the upper two bits, offset in the others.
  using Operand = uint32_t;
  static Operand operand(Base base, size_t offset) {
    return static_cast<uint32_t>(base) << 30 | static_cast<uint32_t>(offset);
  }

  /// Where an image must be looked up: where its last operand is so.
  enum class Guard : uint8_t { none, not_zero, not_one, zero };

  struct Instruction {
    PatternOp op{};
    uint8_t variant = 0;  ///< of a kernel; of an image its Guard
    uint8_t operands = 0, results = 1;
    uint32_t first = 0;       ///< in operands_: results, then operands
    uint32_t parameters = 0;  ///< in parameters_ (floats) or images_
  };
  struct Pass;

  void run_foreign(const ShadingPoints& points, float* batch) const;
  void run(const Instruction& instruction, const Pass& pass, const PatternKernels& kernels) const;
  void look_up(const Instruction& instruction, const PatternCall& call, int count) const;
  void write(const Pass& pass, std::span<const Output> outputs) const;

  std::vector<Instruction> instructions_;
  std::vector<Operand> operands_, outputs_;
  std::vector<float> constants_, parameters_;
  std::vector<PatternImage> images_;
  std::vector<FloatTexturePtr> foreign_float_;  ///< their values come first in the batch's memory, one array each
  std::vector<RgbTexturePtr> foreign_rgb_;      ///< then theirs, three arrays each
  int registers_ = 0, lanes_ = ShadingPoints::capacity;
};

/// Compiles: constants become a ConstantTexture.
FloatTexturePtr make_texture(const PatternFloat& pattern);
RgbTexturePtr make_texture(const PatternColor& pattern);

}  // namespace dapple::pattern
