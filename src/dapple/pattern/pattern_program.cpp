// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_program.h"

#include <algorithm>

#include "dapple/pattern/pattern_compiler.h"
#include "dapple/pattern/pattern_reads.h"

namespace dapple::pattern {

namespace {

using Base = PatternCode::Base;
using Guard = PatternCode::Guard;

constexpr int capacity = ShadingPoints::capacity;
constexpr int vector_lanes = 8;
constexpr size_t stack_floats = 16384;

int round_up(int n) {
  return (n + vector_lanes - 1) / vector_lanes * vector_lanes;
}

}  // namespace

/// One run over the instructions: where operands are, and how many lanes there are.
struct PatternProgram::Pass {
  float* base[4];
  int first = 0, count = 0;

  float* find(PatternCode::Operand o) const { return base[o >> 30] + PatternCode::offset_of(o); }
};

PatternProgram::PatternProgram(std::span<const PatternFloat> outputs, int most_lanes)
    : code_(PatternCompiler(outputs).compile()) {
  const size_t batch = (code_.foreign_float.size() + 3 * code_.foreign_rgb.size()) * capacity;
  const size_t room =
      batch < stack_floats ? (stack_floats - batch) / static_cast<size_t>(std::max(code_.registers, 1)) : 0;
  lanes_ = std::clamp(static_cast<int>(std::min<size_t>(room, capacity)) / vector_lanes * vector_lanes, vector_lanes,
                      most_lanes);
  const auto to_lanes = [&](PatternCode::Operand& o) {
    if (PatternCode::base_of(o) == Base::registers)
      o = PatternCode::operand(Base::registers, PatternCode::offset_of(o) * static_cast<size_t>(lanes_));
  };
  std::for_each(code_.operands.begin(), code_.operands.end(), to_lanes);
  std::for_each(code_.outputs.begin(), code_.outputs.end(), to_lanes);
}

float PatternProgram::work() const {
  float work = 0;
  for (const PatternCode::Instruction& i : code_.instructions) {
    const bool octaves = i.op == PatternOp::fbm || i.op == PatternOp::turbulence || i.op == PatternOp::left_out_octaves;
    const bool over_fifths = i.op == PatternOp::mean_over || i.op == PatternOp::deviation_over;
    const float parameter = octaves || over_fifths ? code_.parameters[i.parameters] : 1;
    work += over_fifths ? instructions_of(i.op) + 5 * instructions_of(static_cast<PatternOp>(parameter))
                        : instructions_of(i.op) * parameter;
  }
  for (const FloatTexturePtr& texture : code_.foreign_float) work += texture->work();
  for (const RgbTexturePtr& texture : code_.foreign_rgb) work += texture->work();
  return work;
}

void PatternProgram::run_foreign(const ShadingPoints& points, float* batch) const {
  for (const FloatTexturePtr& texture : code_.foreign_float) {
    texture->evaluate(points, batch);
    batch += capacity;
  }
  for (const RgbTexturePtr& texture : code_.foreign_rgb) {
    RGB values[capacity];
    texture->evaluate(points, values);
    for (int i = 0; i < points.count; ++i)
      for (int c = 0; c < 3; ++c) batch[c * capacity + i] = values[i][c];
    batch += 3 * capacity;
  }
}

void PatternProgram::look_up(const PatternCode::Instruction& instruction, const PatternCall& call, int count) const {
  const auto guard = static_cast<Guard>(instruction.variant);
  const auto is_seen = [&](int i) {
    const float v = call.in[6][i];
    return guard == Guard::not_zero ? v != 0 : guard == Guard::not_one ? v != 1 : v == 0;
  };
  int seen[capacity], seen_count = 0;
  for (int i = 0; i < count; ++i)
    if (guard == Guard::none || is_seen(i)) seen[seen_count++] = i;

  float gathered[6][capacity];
  const float* in[6];
  for (int k = 0; k < 6; ++k) {
    in[k] = seen_count == count ? call.in[k] : gathered[k];
    if (seen_count < count)
      for (int i = 0; i < seen_count; ++i) gathered[k][i] = call.in[k][seen[i]];
  }
  const PatternImage& image = code_.images[instruction.parameters];
  const int channels = instruction.results;
  float values[3 * capacity];
  if (seen_count > 0)
    image.handle.lookup({seen_count, in[0], in[1], in[2], in[3], in[4], in[5]}, image.sampling, channels, values);
  for (int c = 0; c < channels; ++c) {
    if (seen_count < count) std::fill_n(call.out[c], count, 0.0f);
    for (int i = 0; i < seen_count; ++i) call.out[c][seen[i]] = values[channels * i + c];
  }
}

void PatternProgram::run(const PatternCode::Instruction& instruction, const Pass& pass,
                         const PatternKernels& kernels) const {
  PatternCall call;
  const PatternCode::Operand* o = code_.operands.data() + instruction.first;
  for (int i = 0; i < instruction.results; ++i) call.out[i] = pass.find(*o++);
  for (int i = 0; i < instruction.operands; ++i) call.in[i] = pass.find(*o++);
  if (instruction.op == PatternOp::image) return look_up(instruction, call, pass.count);
  call.count = round_up(pass.count);
  call.results = instruction.results;
  call.parameters = code_.parameters.data() + instruction.parameters;
  kernels.find(instruction.op, instruction.variant)(call);
}

void PatternProgram::write(const Pass& pass, std::span<const Output> outputs) const {
  for (size_t k = 0; k < outputs.size(); ++k) {
    const bool is_number = PatternCode::base_of(code_.outputs[k]) == Base::constants;
    const float* from = pass.find(code_.outputs[k]);
    float* to = outputs[k].data + pass.first * outputs[k].stride;
    for (int i = 0; i < pass.count; ++i) to[i * outputs[k].stride] = from[is_number ? 0 : i];
  }
}

void PatternProgram::evaluate(const ShadingPoints& points, std::span<const Output> outputs,
                              const PatternKernels& kernels) const {
  alignas(64) float on_stack[stack_floats];
  std::vector<float> on_heap;
  const size_t batch = (code_.foreign_float.size() + 3 * code_.foreign_rgb.size()) * capacity;
  const size_t floats = batch + static_cast<size_t>(code_.registers) * static_cast<size_t>(lanes_);
  if (floats > stack_floats) on_heap.resize(floats);
  float* memory = floats > stack_floats ? on_heap.data() : on_stack;

  run_foreign(points, memory);
  for (int first = 0; first < points.count; first += lanes_) {
    // Kernels read inputs and constants, and write registers.
    const Pass pass{{memory + batch, const_cast<float*>(reinterpret_cast<const float*>(&points)) + first,
                     const_cast<float*>(code_.constants.data()), memory + first},
                    first,
                    std::min(lanes_, points.count - first)};
    for (const PatternCode::Instruction& instruction : code_.instructions) run(instruction, pass, kernels);
    write(pass, outputs);
  }
}

namespace {

class FloatPattern final : public FloatTexture {
 public:
  explicit FloatPattern(const PatternFloat& pattern)
      : program_(std::span(&pattern, 1)), reads_(pattern_reads(pattern)), image_(pattern_uv_image(pattern)) {}
  void evaluate(const ShadingPoints& points, float* out) const override {
    const PatternProgram::Output output{out};
    program_.evaluate(points, std::span(&output, 1));
  }
  TextureReads reads() const override { return reads_; }
  float work() const override { return program_.work(); }
  std::optional<UvImage> uv_image() const override { return image_; }

 private:
  const PatternProgram program_;
  const TextureReads reads_;
  const std::optional<UvImage> image_;
};

class RgbPattern final : public RgbTexture {
 public:
  explicit RgbPattern(const PatternColor& c)
      : program_(std::array{c.r, c.g, c.b}),
        reads_(std::max({pattern_reads(c.r), pattern_reads(c.g), pattern_reads(c.b)})) {}
  void evaluate(const ShadingPoints& points, RGB* out) const override {
    const PatternProgram::Output outputs[]{{&out->r, 3}, {&out->g, 3}, {&out->b, 3}};
    program_.evaluate(points, outputs);
  }
  TextureReads reads() const override { return reads_; }
  float work() const override { return program_.work(); }

 private:
  const PatternProgram program_;
  const TextureReads reads_;
};

}  // namespace

FloatTexturePtr make_texture(const PatternFloat& pattern) {
  if (const auto c = pattern.constant()) return std::make_shared<ConstantTexture<float>>(*c);
  return std::make_shared<FloatPattern>(pattern);
}

RgbTexturePtr make_texture(const PatternColor& pattern) {
  if (const auto c = pattern.constant()) return std::make_shared<ConstantTexture<RGB>>(*c);
  return std::make_shared<RgbPattern>(pattern);
}

}  // namespace dapple::pattern
