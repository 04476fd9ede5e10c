// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_graph.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "dapple/base/hash.h"

namespace dapple::pattern {

using Value = PatternGraph::Value;
using Results = PatternGraph::Results;

namespace {

bool commutes(PatternOp op) {
  return op == PatternOp::add || op == PatternOp::multiply;
}

Results results_of(uint32_t node) {
  return {Value{4 * node}, Value{4 * node + 1}, Value{4 * node + 2}};
}

}  // namespace

size_t PatternGraph::Hash::operator()(uint32_t index) const {
  const Node& n = graph->nodes_[index];
  uint64_t h = hash(n.op, n.data);
  for (int i = 0; i < n.operand_count; ++i) h = hash(h, n.operands[static_cast<size_t>(i)].id);
  return h;
}

PatternGraph::PatternGraph() : unique_(0, Hash{this}, Equal{this}) {}

Results PatternGraph::add(const Node& node) {
  const auto place = static_cast<uint32_t>(nodes_.size());
  nodes_.push_back(node);
  const auto [at, is_new] = unique_.insert(place);
  if (!is_new) nodes_.pop_back();
  return results_of(*at);
}

Value PatternGraph::constant(float value) {
  Node n;
  n.op = PatternOp::constant;
  n.data = std::bit_cast<uint32_t>(value);
  return add(n)[0];
}

Value PatternGraph::input(PatternInput input) {
  Node n;
  n.op = PatternOp::input;
  n.data = static_cast<uint32_t>(input);
  return add(n)[0];
}

Results PatternGraph::image(PatternImage image, std::span<const Value, 6> coordinates, int channels) {
  Node n;
  n.op = PatternOp::image;
  n.operand_count = 6;
  n.results = static_cast<uint8_t>(channels);
  n.data = static_cast<uint32_t>(images_.size());
  std::copy(coordinates.begin(), coordinates.end(), n.operands.begin());
  images_.push_back(std::move(image));
  return add(n);
}

Value PatternGraph::foreign(FloatTexturePtr texture) {
  if (const auto c = texture->constant()) return constant(*c);
  Node n;
  n.op = PatternOp::foreign;
  n.data = static_cast<uint32_t>(foreign_float_.size());
  foreign_float_.push_back(std::move(texture));
  return add(n)[0];
}

Results PatternGraph::foreign(RgbTexturePtr texture) {
  if (const auto c = texture->constant()) return {constant(c->r), constant(c->g), constant(c->b)};
  Node n;
  n.op = PatternOp::foreign;
  n.results = 3;
  n.data = static_cast<uint32_t>(foreign_rgb_.size());
  foreign_rgb_.push_back(std::move(texture));
  return add(n);
}

std::optional<float> PatternGraph::number(Value value) const {
  const Node& n = node(value);
  if (n.op != PatternOp::constant) return std::nullopt;
  return std::bit_cast<float>(n.data);
}

/// What stays the same to the last bit for finite operands, the sign of zero apart.
std::optional<Value> PatternGraph::simplified(const Node& n) {
  const auto is = [&](int i, float v) { return number(n.operands[static_cast<size_t>(i)]) == v; };
  const Value a = n.operands[0], b = n.operands[1], c = n.operands[2];
  switch (n.op) {
    case PatternOp::add:
      return is(0, 0) ? std::optional(b) : is(1, 0) ? std::optional(a) : std::nullopt;
    case PatternOp::subtract:
      return is(1, 0) ? std::optional(a) : std::nullopt;
    case PatternOp::multiply:
      if (is(0, 1)) return b;
      if (is(1, 1)) return a;
      return is(0, 0) || is(1, 0) ? std::optional(constant(0)) : std::nullopt;
    case PatternOp::divide:
      return is(1, 1) ? std::optional(a) : std::nullopt;
    case PatternOp::select:
      if (b == c) return b;
      return number(a) ? std::optional(is(0, 0) ? c : b) : std::nullopt;
    case PatternOp::mix:
      if (a == b && number(a)) return a;
      return is(2, 0) ? std::optional(a) : is(2, 1) ? std::optional(b) : std::nullopt;
    default:
      return std::nullopt;
  }
}

Results PatternGraph::folded(const Node& n) {
  constexpr int lanes = 8;
  alignas(64) float in[max_pattern_operands][lanes], out[max_pattern_results][lanes];
  PatternCall call{};
  call.count = lanes;
  call.results = n.results;
  call.parameters = parameters_[n.data]->data();
  for (int i = 0; i < n.operand_count; ++i) {
    std::fill_n(in[i], lanes, *number(n.operands[static_cast<size_t>(i)]));
    call.in[i] = in[i];
  }
  for (int r = 0; r < n.results; ++r) call.out[r] = out[r];
  native_pattern_kernels().find(n.op, 0)(call);
  Results results{};
  for (int r = 0; r < n.results; ++r) results[static_cast<size_t>(r)] = constant(out[r][0]);
  return results;
}

Results PatternGraph::apply(PatternOp op, std::span<const Value> operands, const std::vector<float>& parameters,
                            int results) {
  assert(!is_leaf(op) && op != PatternOp::image && static_cast<int>(operands.size()) == operand_count(op));
  Node n;
  n.op = op;
  n.operand_count = static_cast<uint8_t>(operands.size());
  n.results = static_cast<uint8_t>(results);
  std::copy(operands.begin(), operands.end(), n.operands.begin());
  if (commutes(op) && n.operands[1] < n.operands[0]) std::swap(n.operands[0], n.operands[1]);
  const auto [at, is_new] = parameter_places_.try_emplace(parameters, static_cast<uint32_t>(parameters_.size()));
  if (is_new) parameters_.push_back(&at->first);
  n.data = at->second;
  if (const auto simple = simplified(n)) return {*simple};
  if (std::all_of(operands.begin(), operands.end(), [&](Value v) { return number(v).has_value(); })) return folded(n);
  return add(n);
}

}  // namespace dapple::pattern
