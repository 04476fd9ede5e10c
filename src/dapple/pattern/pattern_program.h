// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/pattern/pattern_code.h"
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

  size_t instruction_count() const { return code_.instructions.size(); }
  float work() const;  ///< Texture::work
  int register_count() const { return code_.registers; }
  int lanes() const { return lanes_; }  ///< points that one pass over the instructions treats

 private:
  struct Pass;

  void run_foreign(const ShadingPoints& points, float* batch) const;
  void run(const PatternCode::Instruction& instruction, const Pass& pass, const PatternKernels& kernels) const;
  void look_up(const PatternCode::Instruction& instruction, const PatternCall& call, int count) const;
  void write(const Pass& pass, std::span<const Output> outputs) const;

  PatternCode code_;  ///< offsets of registers in floats
  int lanes_ = ShadingPoints::capacity;
};

/// Compiles: constants become a ConstantTexture.
FloatTexturePtr make_texture(const PatternFloat& pattern);
RgbTexturePtr make_texture(const PatternColor& pattern);

}  // namespace dapple::pattern
