// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/placement_builder.h"

#include <cmath>

#include "dapple/base/hash.h"

namespace dapple::build {

using scenefile::InstanceEntity;
using scenefile::PlacementFile;
using scenefile::PlacementRows;
using scenefile::PlacementsEntity;
using trace::no_id;
using trace::PlacementTree;

namespace {

// Placements from files that become Embree's own instances: there images can stand for them, and rays are up to a sixth
// faster where objects overlap, for half a kilobyte each.
constexpr size_t most_singles = 1 << 17;
const char* const bad_transform =
    "the transform of what is placed is too small, too large or too flat for single precision, or no number; expected "
    "scales from 1e-10 to 1e9";

void set_rows(const Transform& t, float rows[3][4]) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) rows[r][c] = float(t.matrix()[r][c]);
}

/// What an outer map and the origins of both spaces make of the placements of a file, in double until it is whole.
class OuterMap {
 public:
  OuterMap(const Transform& outer, const V3d& origin, const V3d& own)
      : m_(outer.matrix()), origin_(origin), own_(own) {}

  void apply(const PlacementRows& p, const V3d& chunk, float rows[3][4]) const {
    for (int r = 0; r < 3; ++r) {
      double out[4];
      for (int c = 0; c < 4; ++c) {
        out[c] = 0;
        for (int k = 0; k < 3; ++k) out[c] += m_[r][k] * (double(p[size_t(4 * k + c)]) + (c == 3 ? chunk[k] : 0));
      }
      out[3] += m_[r][3] - origin_[r] + out[0] * own_.x + out[1] * own_.y + out[2] * own_.z;
      for (int c = 0; c < 4; ++c) rows[r][c] = float(out[c]);
    }
  }

 private:
  const M44d m_;
  const V3d origin_, own_;
};

}  // namespace

V3d PlacementBuilder::origin(int32_t owner) const {
  return owner == in_scene ? context_.origins.scene : context_.origins.objects[size_t(owner)];
}

void PlacementBuilder::place_all(const std::vector<bool>& skip) {
  const auto& d = context_.description;
  placed_.assign(d.objects.size(), 0);
  for (size_t i = 0; i < d.objects.size(); ++i) place_in_object(int32_t(i));
  place(d.instances, &skip, in_scene);
  for (const PlacementsEntity& p : d.placements) place(p, in_scene);
}

// What stands in an object has to be whole before it is placed there.
void PlacementBuilder::place_in_object(int32_t object) {
  if (placed_[size_t(object)]) return;
  placed_[size_t(object)] = 1;
  for_each_placed(context_.description, object, [this](int32_t inner) { place_in_object(inner); });
  const auto& o = context_.description.objects[size_t(object)];
  place(o.instances, nullptr, object);
  for (const PlacementsEntity& p : o.placements) place(p, object);
}

void PlacementBuilder::place(const std::vector<InstanceEntity>& instances, const std::vector<bool>* skip,
                             int32_t owner) {
  const auto& d = context_.description;
  struct Placed {
    trace::PlacementSet set;
    const FileLoc* last;
  };
  std::map<int32_t, Placed> by_object;
  for (size_t i = 0; i < instances.size(); ++i) {
    const InstanceEntity& instance = instances[i];
    if (!instance.is_shown() || (skip && (*skip)[i])) continue;
    if (owner == in_scene && !d.objects[size_t(instance.object)].holds_objects()) continue;
    const scenefile::TransformPair exact = instance.transform.exact();
    if (exact.is_animated())
      throw InputError(instance.loc, owner == in_scene
                                         ? "an instance of an object that holds others moves; it must stand still"
                                         : "an instance inside of a definition moves; it must stand still");
    check_still(instance.object, instance.loc);
    float rows[3][4];
    const Transform whole = Transform::translate(-origin(owner)) * exact.start;
    set_rows(with_base(whole, origin(instance.object)), rows);
    const float reach = checked_reach(instance.object, rows, instance.loc, "");
    if (owner == in_scene && reach < reach_) reach_ = reach, narrowest_ = instance.loc;
    Placed& placed = by_object[instance.object];
    placed.set.add(rows);
    placed.last = &instance.loc;
  }
  for (auto& [object, placed] : by_object) add(object, std::move(placed.set), owner, *placed.last);
}

void PlacementBuilder::place(const PlacementsEntity& p, int32_t owner) {
  check_still(p.object, p.loc);
  const PlacementFile file(context_.description.resolve(p.filename), p.loc);
  check_paths(p.object, file.size(), owner, p.loc);
  trace::PlacementSet set;
  set.reserve(file.size());
  const OuterMap map(p.transform, origin(owner), origin(p.object));
  file.for_each_block([&](const PlacementFile::Chunk& chunk, uint64_t first, std::span<const PlacementRows> block) {
    for (const PlacementRows& placement : block) {
      float rows[3][4];
      map.apply(placement, chunk.origin, rows);
      const float reach = traced_.reach_of_placement(objects_[size_t(p.object)], rows);
      if (!(reach > 0))
        checked_reach(p.object, rows, p.loc, p.filename + ": placement " + std::to_string(set.size() + 1) + ": ");
      if (owner == in_scene && reach < reach_) reach_ = reach, narrowest_ = p.loc;
      set.add(rows);
    }
    fingerprint_ = hash_bytes({reinterpret_cast<const char*>(block.data()), block.size_bytes()}, fingerprint_);
    if (first == 0)
      fingerprint_ = hash_bytes({reinterpret_cast<const char*>(&chunk.origin), sizeof chunk.origin}, fingerprint_);
  });
  add(p.object, std::move(set), owner, p.loc);
}

void PlacementBuilder::check_still(int32_t object, const FileLoc& loc) const {
  const auto& o = context_.description.objects[size_t(object)];
  if (const FileLoc* moving = moving_(objects_[size_t(object)]))
    throw InputError(loc, "object \"" + o.name +
                              "\" is placed in an object, by a file, or holds others, but holds a "
                              "shape that moves or deforms, at " +
                              moving->to_string() + "; it must stand still");
}

float PlacementBuilder::checked_reach(int32_t object, const float rows[3][4], const FileLoc& loc,
                                      const std::string& which) const {
  const float reach = traced_.reach_of_placement(objects_[size_t(object)], rows);
  if (reach > 0) return reach;
  throw InputError(loc, which + bad_transform);
}

uint32_t PlacementBuilder::traced_object(int32_t owner) const {
  return owner == in_scene ? no_id : objects_[size_t(owner)];
}

void PlacementBuilder::check_paths(int32_t object, uint64_t placements, int32_t owner, const FileLoc& loc) const {
  const PlacementTree& tree = traced_.placements();
  // Instances of the text come after these; those of files, and what moves by itself, are there.
  const uint64_t singles = owner == in_scene ? context_.description.instances.size() + traced_.single_count() : 0,
                 before = tree.paths(traced_object(owner)) + singles;
  if (before + placements > PlacementTree::most_paths ||
      before + placements * tree.paths(traced_object(object)) > PlacementTree::most_paths)
    throw InputError(loc, "there are more than " + std::to_string(PlacementTree::most_paths) +
                              " ways from the scene through placed objects to their shapes; expected fewer "
                              "placements, or larger objects");
}

void PlacementBuilder::add(int32_t object, trace::PlacementSet set, int32_t owner, const FileLoc& loc) {
  check_paths(object, set.size(), owner, loc);
  const uint32_t inner = objects_[size_t(object)];
  const bool as_singles = owner == in_scene && !context_.description.objects[size_t(object)].holds_objects() &&
                          traced_.single_count() + set.size() <= most_singles;
  if (const uint32_t repeated = as_singles ? add_singles(inner, std::move(set), loc)
                                           : traced_.add_placements(inner, std::move(set), traced_object(owner)))
    context_.diagnostics.warn(loc,
                              std::to_string(repeated) +
                                  " placements stand at the very same place as others of "
                                  "their object; once is enough",
                              "repeated instance");
}

uint32_t PlacementBuilder::add_singles(uint32_t object, trace::PlacementSet set, const FileLoc& loc) {
  const uint32_t repeated = set.arrange();
  for (uint32_t i = 0; i < set.size(); ++i) {
    float rows[3][4];
    set.rows(i, rows);
    M44d m;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) m[r][c] = double(rows[r][c]);
    const Transform t(m);
    const AnimatedTransform still(t, t);
    if (!(trace::instance_reach(still) > 0)) throw InputError(loc, bad_transform);
    traced_.add_instance(object, still);
  }
  return repeated;
}

}  // namespace dapple::build
