// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>
#include <vector>

#include "dapple/image/texture_system.h"
#include "dapple/pattern/pattern_op.h"
#include "dapple/pattern/texture.h"

namespace dapple::pattern {

/// The arrays of ShadingPoints that a pattern may read. No direction to the eye: patterns do not depend on the view.
enum class PatternInput : uint8_t {
  u,
  v,
  dudx,
  dudy,
  dvdx,
  dvdy,
  time,
  Px,
  Py,
  Pz,
  dPdx_x,
  dPdx_y,
  dPdx_z,
  dPdy_x,
  dPdy_y,
  dPdy_z,
  Ngx,
  Ngy,
  Ngz,
  Nsx,
  Nsy,
  Nsz,
  dPdu_x,
  dPdu_y,
  dPdu_z,
  dPdv_x,
  dPdv_y,
  dPdv_z
};

/// An image as an instruction reads it; values as TextureHandle::lookup() gives them.
struct PatternImage {
  image::TextureHandle handle;
  image::TextureSampling sampling;
};

/// The expressions of many patterns, side by side: a directed acyclic graph of operations on floats. Equal operations
/// on equal operands are one node, those on numbers are numbers. Nodes only grow in number; operands come before their
/// users. Reading is thread-safe, adding is not. PatternProgram turns what one pattern needs of it into instructions.
class PatternGraph {
 public:
  /// One result of a node.
  struct Value {
    uint32_t id = 0;  ///< 4 node + result
    friend auto operator<=>(Value, Value) = default;
    uint32_t node() const { return id / 4; }
    uint32_t result() const { return id % 4; }
  };
  using Results = std::array<Value, max_pattern_results>;
  using Footprint = std::array<Value, 2>;  ///< changes from one sample to the next, in x and y

  struct Node {
    PatternOp op{};
    uint8_t operand_count = 0, results = 1;
    uint32_t data = 0;  ///< bits of a constant; PatternInput; place in parameters, images or foreign textures
    std::array<Value, max_pattern_operands> operands{};
    friend bool operator==(const Node&, const Node&) = default;
  };

  PatternGraph();
  PatternGraph(const PatternGraph&) = delete;
  PatternGraph& operator=(const PatternGraph&) = delete;

  Value constant(float value);
  Value input(PatternInput input);
  /// An operation of PatternOp::absolute to hsv_to_rgb.
  Results apply(PatternOp op, std::span<const Value> operands, const std::vector<float>& parameters = {},
                int results = 1);
  Value apply(PatternOp op, std::initializer_list<Value> operands) {
    return apply(op, std::span(operands.begin(), operands.size()))[0];
  }
  /// channels: 1 or 3.
  Results image(PatternImage image, std::span<const Value, 6> coordinates, int channels);
  /// A texture that is evaluated as it is, whole batches at a time.
  Value foreign(FloatTexturePtr texture);
  Results foreign(RgbTexturePtr texture);

  /// What pattern_footprint.h has found out about a value; null: nothing yet.
  const Footprint* known_footprint(Value value) const {
    const auto at = footprints_.find(value);
    return at == footprints_.end() ? nullptr : &at->second;
  }
  /// The first of a value stays.
  void keep_footprint(Value value, const Footprint& footprint) { footprints_.emplace(value, footprint); }
  /// What pattern_spread.h has found out about a value; null: nothing yet.
  const Value* known_spread(Value value) const {
    const auto at = spreads_.find(value);
    return at == spreads_.end() ? nullptr : &at->second;
  }
  /// The first of a value stays.
  void keep_spread(Value value, Value spread) { spreads_.emplace(value, spread); }

  std::optional<float> number(Value value) const;
  const Node& node(Value value) const { return nodes_[value.node()]; }
  size_t size() const { return nodes_.size(); }
  const std::vector<float>& parameters(const Node& n) const { return *parameters_[n.data]; }
  const PatternImage& image(const Node& n) const { return images_[n.data]; }
  const FloatTexturePtr& foreign_float(const Node& n) const { return foreign_float_[n.data]; }
  const RgbTexturePtr& foreign_rgb(const Node& n) const { return foreign_rgb_[n.data]; }

 private:
  struct Hash {
    const PatternGraph* graph;
    size_t operator()(uint32_t index) const;
  };
  struct Equal {
    const PatternGraph* graph;
    bool operator()(uint32_t a, uint32_t b) const { return graph->nodes_[a] == graph->nodes_[b]; }
  };

  Results add(const Node& node);
  std::optional<Value> simplified(const Node& node);
  Results folded(const Node& node);

  std::vector<Node> nodes_;
  std::unordered_set<uint32_t, Hash, Equal> unique_;
  std::map<std::vector<float>, uint32_t> parameter_places_;
  std::vector<const std::vector<float>*> parameters_;  // the map's keys
  std::vector<PatternImage> images_;
  std::vector<FloatTexturePtr> foreign_float_;
  std::vector<RgbTexturePtr> foreign_rgb_;
  std::map<Value, Footprint> footprints_;
  std::map<Value, Value> spreads_;
};

}  // namespace dapple::pattern
