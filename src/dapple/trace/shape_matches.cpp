// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/shape_matches.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <tuple>

#include "dapple/base/hash.h"

namespace dapple::trace {

namespace {

/// What shapes that correspond have in common: object, kind, primitives, and how these are joined.
using ShapeKind = std::tuple<uint32_t, size_t, size_t, uint64_t>;

template <class T>
uint64_t digest(uint64_t seed, const std::vector<T>& values) {
  return hash_bytes({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)}, seed);
}

ShapeKind kind_of(const Shape& shape, uint32_t object) {
  size_t parts = 0;
  uint64_t joined = 0;
  if (const auto* mesh = std::get_if<MeshPtr>(&shape)) {
    parts = (*mesh)->P.size();
    joined = digest(uint64_t((*mesh)->corners), (*mesh)->indices);
  } else if (const auto* grids = std::get_if<GridsPtr>(&shape)) {
    parts = (*grids)->P.size();
    joined = digest(0, (*grids)->grids);
  } else if (const auto* curves = std::get_if<CurvesPtr>(&shape)) {
    parts = (*curves)->control_points.size();
    joined = uint64_t((*curves)->kind);
  } else if (const auto* disks = std::get_if<DisksPtr>(&shape)) {
    parts = (*disks)->disks.size();
  } else {
    joined = uint64_t(std::get<QuadricPtr>(shape)->kind());
  }
  return {object, shape.index(), parts, joined};
}

/// Of what rays meet, equal for equal shapes.
uint64_t key_of(const Shape& shape) {
  if (const auto* mesh = std::get_if<MeshPtr>(&shape))
    return digest(digest(digest(uint64_t((*mesh)->flip), (*mesh)->P), (*mesh)->P_end), (*mesh)->uv);
  if (const auto* grids = std::get_if<GridsPtr>(&shape)) return digest(digest(0, (*grids)->P), (*grids)->P_end);
  if (const auto* curves = std::get_if<CurvesPtr>(&shape)) return digest(0, (*curves)->control_points);
  if (const auto* disks = std::get_if<DisksPtr>(&shape)) return digest(digest(0, (*disks)->disks), (*disks)->normals);
  const geom::Quadric& q = *std::get<QuadricPtr>(shape);
  std::vector<V3f> places;  // of its surface
  for (const float u : {0.0f, .3f, 1.0f})
    for (const float v : {0.0f, .4f, 1.0f}) places.push_back(q.at(u, v).P);
  return digest(uint64_t(q.flip()), places);
}

template <class Kind>
using Groups = std::map<Kind, std::vector<uint32_t>>;

Groups<ShapeKind> shapes_of(const TracedScene& scene) {
  Groups<ShapeKind> groups;
  const auto add = [&](uint32_t object) {
    for (const uint32_t g : scene.geometries_in(object)) groups[kind_of(scene.shape(g), object)].push_back(g);
  };
  add(no_id);
  for (uint32_t object = 0; object < scene.object_count(); ++object) add(object);
  return groups;
}

Groups<uint32_t> instances_of(const TracedScene& scene) {
  Groups<uint32_t> groups;
  for (uint32_t i = 0; i < scene.single_count(); ++i) groups[scene.object_of(i)].push_back(i);
  return groups;
}

/// In their order, all of a group or those that are equal. `key`: of a shape or instance, equal for equal ones.
template <class Kind, class Key>
std::vector<uint32_t> match(const Groups<Kind>& here, const Groups<Kind>& there, size_t count, const Key& key) {
  std::vector<uint32_t> found(count, no_id);
  for (const auto& [kind, members] : here) {
    const auto group = there.find(kind);
    if (group == there.end()) continue;
    const std::vector<uint32_t>& others = group->second;
    if (members.size() == others.size()) {
      for (size_t k = 0; k < members.size(); ++k) found[members[k]] = others[k];
      continue;
    }
    Groups<uint64_t> equal;
    for (auto other = others.rbegin(); other != others.rend(); ++other) equal[key(false, *other)].push_back(*other);
    for (const uint32_t member : members) {
      const auto at = equal.find(key(true, member));
      if (at == equal.end() || at->second.empty()) continue;
      found[member] = at->second.back();
      at->second.pop_back();
    }
  }
  return found;
}

bool same_placements(const TracedScene& a, const TracedScene& b) {
  const auto same = [&](uint32_t owner) {
    const auto of_a = a.placements().sets_of(owner), of_b = b.placements().sets_of(owner);
    if (of_a.size() != of_b.size()) return false;
    for (size_t s = 0; s < of_a.size(); ++s) {
      const PlacementSet &x = of_a[s]->placements, &y = of_b[s]->placements;
      if (of_a[s]->object != of_b[s]->object || x.size() != y.size() ||
          (x.size() > 0 &&
           std::memcmp(x.blocks().data(), y.blocks().data(), x.blocks().size() * sizeof(PlacementSet::Block)) != 0))
        return false;
    }
    return true;
  };
  if (a.object_count() != b.object_count() || !same(no_id)) return false;
  for (uint32_t object = 0; object < a.object_count(); ++object)
    if (!same(object)) return false;
  return true;
}

}  // namespace

ShapeMatches::ShapeMatches(const TracedScene& here, const TracedScene& there)
    : placed_(here.instance_count() - here.single_count()),
      first_placed_there_(there.single_count()),
      same_placements_(same_placements(here, there)) {
  const auto scene = [&](bool is_here) -> const TracedScene& { return is_here ? here : there; };
  geometry_ = match(shapes_of(here), shapes_of(there), here.geometry_count(),
                    [&](bool is_here, uint32_t g) { return key_of(scene(is_here).shape(g)); });
  instance_ = match(instances_of(here), instances_of(there), here.single_count(), [&](bool is_here, uint32_t i) {
    std::vector<float> rows(24);
    for (const int end : {0, 1}) {
      float m[3][4];
      scene(is_here).instance_rows(i, float(end), m);
      std::memcpy(&rows[size_t(12 * end)], m, sizeof m);
    }
    return digest(0, rows);
  });
}

bool ShapeMatches::rename(HitBatch* hits, int i) const {
  const uint32_t geometry = geometry_[hits->geometry[i]];
  uint32_t instance = hits->instance[i];
  if (instance != no_id) {
    if (instance < instance_.size())
      instance = instance_[instance];
    else
      instance = same_placements_ ? instance - uint32_t(instance_.size()) + first_placed_there_ : no_id;
    if (instance == no_id) return false;
  }
  if (geometry == no_id) return false;
  hits->geometry[i] = geometry, hits->instance[i] = instance;
  return true;
}

size_t ShapeMatches::lost_shapes() const {
  return size_t(std::count(geometry_.begin(), geometry_.end(), no_id));
}

size_t ShapeMatches::lost_instances() const {
  return size_t(std::count(instance_.begin(), instance_.end(), no_id)) + (same_placements_ ? 0 : placed_);
}

}  // namespace dapple::trace
