// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "dapple/pattern/pattern_code.h"
#include "dapple/pattern/pattern_value.h"

namespace dapple::pattern {

/// From a graph to instructions: takes what the outputs need, orders it so that few values are alive at once, fuses
/// products into sums, guards images that a mix hides at some points, and gives values registers, which are used again
/// as soon as a value has had its last use. Not recursive: time and memory are proportional to the nodes needed,
/// however deep.
class PatternCompiler {
 public:
  /// At least one output, all of one graph.
  explicit PatternCompiler(std::span<const PatternFloat> outputs);
  /// Once.
  PatternCode compile();

 private:
  using Value = PatternGraph::Value;
  /// A node that an output needs, as it will be computed: maybe fused with another.
  struct Step {
    PatternGraph::Node node;
    uint32_t uses = 0;       ///< of any result, by steps and outputs
    uint32_t registers = 1;  ///< alive at once while it is computed, about (Sethi and Ullman 1970)
    uint32_t last_use = 0;   ///< place in order_
    uint32_t place[max_pattern_results] = {};
    PatternCode::Guard guard = PatternCode::Guard::none;  ///< of an image, by its last operand
    bool fused = false;                                   ///< into its user
  };

  bool is_computed(Value v) const;  ///< by an instruction
  std::span<const Value> operands(const Step& s) const { return {s.node.operands.data(), s.node.operand_count}; }
  Step& step(Value v) { return steps_.at(v.node()); }

  void find_needed();
  void fuse();
  void guard_images();
  bool depends(uint32_t node, uint32_t on) const;
  void order();
  void find_last_uses();
  void emit();
  void emit(uint32_t at);
  PatternCode::Operand locate(Value v);
  PatternCode::Operand leaf(const PatternGraph::Node& n);
  uint32_t take_register();
  uint32_t parameters_of(const PatternGraph::Node& n);
  uint32_t number_place(float v);

  const PatternGraph& graph_;
  std::vector<Value> outputs_;
  PatternCode code_;
  std::unordered_map<uint32_t, Step> steps_;  // by node
  std::vector<uint32_t> needed_, order_;      // nodes
  std::vector<uint32_t> free_registers_;
  std::unordered_map<uint32_t, uint32_t> numbers_;              // places of constants, by bits
  std::unordered_map<uint64_t, uint32_t> parameter_places_;     // by the graph's
  std::unordered_map<uint32_t, PatternCode::Operand> foreign_;  // first array, by node
};

}  // namespace dapple::pattern
