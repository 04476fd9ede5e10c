// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_reads.h"

namespace dapple::pattern {

namespace {

using Value = PatternGraph::Value;

TextureReads reads_of_node(const PatternGraph& graph, Value value) {
  const PatternGraph::Node& n = graph.node(value);
  if (n.op == PatternOp::foreign)
    return n.results == 1 ? graph.foreign_float(n)->reads() : graph.foreign_rgb(n)->reads();
  if (n.op != PatternOp::input) return TextureReads::uv;
  const auto input = static_cast<PatternInput>(n.data);
  if (input == PatternInput::time) return TextureReads::time;
  return input < PatternInput::time ? TextureReads::uv : TextureReads::surface;
}
static_assert(PatternInput::v < PatternInput::time && PatternInput::dvdy < PatternInput::time &&
              PatternInput::Px > PatternInput::time);

struct Affine {
  float scale, offset;
};

/// value = scale * input + offset, as uv_mapping() builds it: of no more than two operations.
std::optional<Affine> affine_of(const PatternGraph& graph, Value value, PatternInput input, int operations = 2) {
  const PatternGraph::Node& n = graph.node(value);
  if (n.op == PatternOp::input && static_cast<PatternInput>(n.data) == input) return Affine{1, 0};
  if (operations == 0 || (n.op != PatternOp::add && n.op != PatternOp::multiply)) return std::nullopt;
  for (int i = 0; i < 2; ++i) {
    const auto number = graph.number(n.operands[size_t(1 - i)]);
    const auto inner = number ? affine_of(graph, n.operands[size_t(i)], input, operations - 1) : std::nullopt;
    if (!inner) continue;
    return n.op == PatternOp::add ? Affine{inner->scale, inner->offset + *number}
                                  : Affine{inner->scale * *number, inner->offset * *number};
  }
  return std::nullopt;
}

}  // namespace

TextureReads pattern_reads(const PatternFloat& pattern) {
  const PatternGraph& graph = pattern.graph();
  std::unordered_set<uint32_t> seen{pattern.value().node()};
  std::vector<Value> open{pattern.value()};
  TextureReads reads = TextureReads::uv;
  while (!open.empty()) {
    const Value value = open.back();
    open.pop_back();
    reads = std::max(reads, reads_of_node(graph, value));
    const PatternGraph::Node& n = graph.node(value);
    for (int i = 0; i < n.operand_count; ++i)
      if (seen.insert(n.operands[size_t(i)].node()).second) open.push_back(n.operands[size_t(i)]);
  }
  return reads;
}

std::optional<UvImage> pattern_uv_image(const PatternFloat& pattern) {
  const PatternGraph& graph = pattern.graph();
  const PatternGraph::Node& n = graph.node(pattern.value());
  if (n.op != PatternOp::image || n.results != 1) return std::nullopt;
  const auto s = affine_of(graph, n.operands[0], PatternInput::u), t = affine_of(graph, n.operands[1], PatternInput::v);
  if (!s || !t) return std::nullopt;
  const PatternImage& image = graph.image(n);
  return UvImage{image.handle, image.sampling, {s->scale, t->scale}, {s->offset, t->offset}};
}

}  // namespace dapple::pattern
