// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_compiler.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace dapple::pattern {

namespace {

constexpr size_t capacity = ShadingPoints::capacity;

#define DAPPLE_INPUT(member) offsetof(ShadingPoints, member) / sizeof(float)
// In the order of PatternInput.
constexpr std::array<size_t, 28> input_offsets{
    DAPPLE_INPUT(u),      DAPPLE_INPUT(v),      DAPPLE_INPUT(dudx),   DAPPLE_INPUT(dudy),   DAPPLE_INPUT(dvdx),
    DAPPLE_INPUT(dvdy),   DAPPLE_INPUT(time),   DAPPLE_INPUT(P.x),    DAPPLE_INPUT(P.y),    DAPPLE_INPUT(P.z),
    DAPPLE_INPUT(dPdx.x), DAPPLE_INPUT(dPdx.y), DAPPLE_INPUT(dPdx.z), DAPPLE_INPUT(dPdy.x), DAPPLE_INPUT(dPdy.y),
    DAPPLE_INPUT(dPdy.z), DAPPLE_INPUT(Ng.x),   DAPPLE_INPUT(Ng.y),   DAPPLE_INPUT(Ng.z),   DAPPLE_INPUT(Ns.x),
    DAPPLE_INPUT(Ns.y),   DAPPLE_INPUT(Ns.z),   DAPPLE_INPUT(dPdu.x), DAPPLE_INPUT(dPdu.y), DAPPLE_INPUT(dPdu.z),
    DAPPLE_INPUT(dPdv.x), DAPPLE_INPUT(dPdv.y), DAPPLE_INPUT(dPdv.z)};
#undef DAPPLE_INPUT

}  // namespace

PatternCompiler::PatternCompiler(std::span<const PatternFloat> outputs) : graph_(outputs.front().graph()) {
  for (const PatternFloat& output : outputs) outputs_.push_back(output.value());
}

PatternCode PatternCompiler::compile() {
  find_needed();
  guard_images();
  fuse();
  order();
  find_last_uses();
  emit();
  return std::move(code_);
}

bool PatternCompiler::is_computed(Value v) const {
  return !is_leaf(graph_.node(v).op);
}

void PatternCompiler::find_needed() {
  std::vector<Value> open;
  const auto use = [&](Value v) {
    const auto [at, is_new] = steps_.try_emplace(v.node());
    if (is_new) {
      at->second.node = graph_.node(v);
      open.push_back(v);
      needed_.push_back(v.node());
    }
    ++at->second.uses;
  };
  for (const Value v : outputs_) use(v);
  while (!open.empty()) {
    const PatternGraph::Node& n = graph_.node(open.back());
    open.pop_back();
    for (size_t i = 0; i < n.operand_count; ++i) use(n.operands[i]);
  }
  std::sort(needed_.begin(), needed_.end());
}

/// True if `node` needs `on`, guards included; also where finding out would take long.
bool PatternCompiler::depends(uint32_t node, uint32_t on) const {
  constexpr size_t patience = 10000;
  std::vector<uint32_t> open{node};
  std::unordered_map<uint32_t, bool> seen{{node, true}};
  while (!open.empty()) {
    const uint32_t place = open.back();
    open.pop_back();
    if (place == on || seen.size() > patience) return true;
    for (const Value v : operands(steps_.at(place)))
      if (seen.try_emplace(v.node(), true).second) open.push_back(v.node());
  }
  return false;
}

/// An image all of whose users stand on one side of a mix or select is looked up only where that side counts.
void PatternCompiler::guard_images() {
  struct Need {
    PatternCode::Guard guard = PatternCode::Guard::none;
    Value by;
    bool operator==(const Need&) const = default;
  };
  using enum PatternCode::Guard;
  std::unordered_map<uint32_t, Need> needs;
  for (const Value v : outputs_) needs[v.node()] = {};
  const auto need_of = [](const PatternGraph::Node& n, size_t operand, const Need& own) -> Need {
    if (n.op == PatternOp::mix && operand < 2) return {operand == 0 ? not_one : not_zero, n.operands[2]};
    if (n.op == PatternOp::select && operand > 0) return {operand == 1 ? not_zero : zero, n.operands[0]};
    return own;
  };
  for (auto place = needed_.rbegin(); place != needed_.rend(); ++place) {  // users first
    const PatternGraph::Node& n = steps_.at(*place).node;
    const Need own = needs.at(*place);
    for (size_t i = 0; i < n.operand_count; ++i) {
      const Need need = need_of(n, i, own);
      const auto [at, is_first] = needs.try_emplace(n.operands[i].node(), need);
      if (!is_first && !(at->second == need)) at->second = {};
    }
  }
  for (const uint32_t place : needed_) {
    Step& s = steps_.at(place);
    const Need need = needs.at(place);
    if (s.node.op != PatternOp::image || need.guard == none || graph_.number(need.by)) continue;
    if (depends(need.by.node(), place)) continue;
    s.guard = need.guard;
    s.node.operands[s.node.operand_count++] = need.by;
    ++step(need.by).uses;
  }
}

/// a b + c in one instruction where nothing else needs a b. Rounded as before.
void PatternCompiler::fuse() {
  for (const uint32_t place : needed_) {
    Step& sum = steps_.at(place);
    if (sum.node.op != PatternOp::add) continue;
    for (const int i : {0, 1}) {
      const Value factor = sum.node.operands[static_cast<size_t>(i)],
                  other = sum.node.operands[static_cast<size_t>(1 - i)];
      Step& product = step(factor);
      if (product.node.op != PatternOp::multiply || product.uses != 1 || factor == other) continue;
      product.fused = true;
      sum.node.op = PatternOp::multiply_add;
      sum.node.operand_count = 3;
      sum.node.operands = {product.node.operands[0], product.node.operands[1], other};
      break;
    }
  }
  std::erase_if(needed_, [&](uint32_t place) { return steps_.at(place).fused; });
}

/// Depth first, the operand that takes most registers first.
void PatternCompiler::order() {
  const auto by_registers = [&](const Step& s) {
    std::vector<Value> sorted;
    for (const Value v : operands(s))
      if (is_computed(v)) sorted.push_back(v);
    std::stable_sort(sorted.begin(), sorted.end(),
                     [&](Value a, Value b) { return step(a).registers > step(b).registers; });
    return sorted;
  };
  for (const uint32_t place : needed_) {
    Step& s = steps_.at(place);
    uint32_t held = 0;
    s.registers = s.node.results;
    for (const Value v : by_registers(s)) s.registers = std::max(s.registers, step(v).registers + held++);
  }
  std::unordered_map<uint32_t, bool> done;
  for (const Value output : outputs_) {
    std::vector<Value> open{output};
    while (!open.empty()) {
      const Value v = open.back();
      if (!is_computed(v) || done[v.node()]) {
        open.pop_back();
        continue;
      }
      bool ready = true;
      const std::vector<Value> sorted = by_registers(step(v));
      for (auto operand = sorted.rbegin(); operand != sorted.rend(); ++operand)
        if (!done[operand->node()]) {
          open.push_back(*operand);
          ready = false;
        }
      if (!ready) continue;
      done[v.node()] = true;
      order_.push_back(v.node());
      open.pop_back();
    }
  }
}

void PatternCompiler::find_last_uses() {
  for (uint32_t i = 0; i < order_.size(); ++i)
    for (const Value v : operands(steps_.at(order_[i]))) step(v).last_use = i;
  for (const Value v : outputs_) step(v).last_use = static_cast<uint32_t>(order_.size());
}

uint32_t PatternCompiler::take_register() {
  if (free_registers_.empty()) return static_cast<uint32_t>(code_.registers++);
  const uint32_t r = free_registers_.back();
  free_registers_.pop_back();
  return r;
}

uint32_t PatternCompiler::number_place(float v) {
  const auto [at, is_new] =
      numbers_.try_emplace(std::bit_cast<uint32_t>(v), static_cast<uint32_t>(code_.constants.size()));
  if (is_new) code_.constants.push_back(v);
  return at->second;
}

uint32_t PatternCompiler::parameters_of(const PatternGraph::Node& n) {
  if (n.op == PatternOp::image) {
    code_.images.push_back(graph_.image(n));
    return static_cast<uint32_t>(code_.images.size() - 1);
  }
  if (is_elementwise(n.op)) return 0;
  const auto [at, is_new] = parameter_places_.try_emplace(n.data, static_cast<uint32_t>(code_.parameters.size()));
  if (is_new) {
    const std::vector<float>& p = graph_.parameters(n);
    code_.parameters.insert(code_.parameters.end(), p.begin(), p.end());
  }
  return at->second;
}

PatternCode::Operand PatternCompiler::leaf(const PatternGraph::Node& n) {
  using Place = PatternCode::Base;
  if (n.op == PatternOp::constant)
    return PatternCode::operand(Place::constants, number_place(std::bit_cast<float>(n.data)));
  return PatternCode::operand(Place::inputs, input_offsets[n.data]);
}

PatternCode::Operand PatternCompiler::locate(Value v) {
  const PatternGraph::Node& n = graph_.node(v);
  if (n.op == PatternOp::foreign) return foreign_.at(v.node()) + v.result() * static_cast<uint32_t>(capacity);
  if (is_leaf(n.op)) return leaf(n);
  return PatternCode::operand(PatternCode::Base::registers, step(v).place[v.result()]);
}

void PatternCompiler::emit(uint32_t at) {
  Step& s = steps_.at(order_[at]);
  const PatternGraph::Node& n = s.node;
  PatternCode::Instruction instruction;
  instruction.op = n.op;
  instruction.operands = n.operand_count;
  instruction.results = n.results;

  std::vector<uint32_t> temporary;
  std::vector<PatternCode::Operand> in;
  for (const Value v : operands(s)) in.push_back(locate(v));
  const auto is_number = [](PatternCode::Operand o) { return PatternCode::base_of(o) == PatternCode::Base::constants; };
  int variant = 0;
  for (size_t i = 0; i < in.size() && i < 3; ++i) variant |= is_number(in[i]) ? 1 << i : 0;
  if (n.op == PatternOp::image) instruction.variant = static_cast<uint8_t>(s.guard);
  if (is_elementwise(n.op) && native_pattern_kernels().find(n.op, variant)) {
    instruction.variant = static_cast<uint8_t>(variant);
  } else {
    for (PatternCode::Operand& o : in) {
      if (!is_number(o)) continue;
      PatternCode::Instruction fill;
      fill.op = PatternOp::constant;
      fill.first = static_cast<uint32_t>(code_.operands.size());
      fill.parameters = static_cast<uint32_t>(code_.parameters.size());
      code_.parameters.push_back(code_.constants[PatternCode::offset_of(o)]);
      temporary.push_back(take_register());
      o = PatternCode::operand(PatternCode::Base::registers, temporary.back());
      code_.operands.push_back(o);
      code_.instructions.push_back(fill);
    }
  }

  const auto release_operands = [&] {
    for (const Value v : operands(s)) {
      Step& o = step(v);
      if (!is_computed(v) || o.last_use != at) continue;
      free_registers_.insert(free_registers_.end(), o.place, o.place + o.node.results);
      o.last_use = UINT32_MAX;
    }
    free_registers_.insert(free_registers_.end(), temporary.begin(), temporary.end());
  };
  if (is_elementwise(n.op)) release_operands();
  for (int r = 0; r < n.results; ++r) s.place[r] = take_register();
  if (!is_elementwise(n.op)) release_operands();

  instruction.first = static_cast<uint32_t>(code_.operands.size());
  instruction.parameters = parameters_of(n);
  for (int r = 0; r < n.results; ++r)
    code_.operands.push_back(PatternCode::operand(PatternCode::Base::registers, s.place[r]));
  code_.operands.insert(code_.operands.end(), in.begin(), in.end());
  code_.instructions.push_back(instruction);
}

void PatternCompiler::emit() {
  for (const int results : {1, 3})
    for (const uint32_t place : needed_) {
      const PatternGraph::Node& n = steps_.at(place).node;
      if (n.op != PatternOp::foreign || n.results != results) continue;
      const size_t arrays = code_.foreign_float.size() + 3 * code_.foreign_rgb.size();
      foreign_[place] = PatternCode::operand(PatternCode::Base::batch, arrays * capacity);
      if (results == 1)
        code_.foreign_float.push_back(graph_.foreign_float(n));
      else
        code_.foreign_rgb.push_back(graph_.foreign_rgb(n));
    }
  for (uint32_t i = 0; i < order_.size(); ++i) emit(i);
  for (const Value v : outputs_) code_.outputs.push_back(locate(v));
}

}  // namespace dapple::pattern
