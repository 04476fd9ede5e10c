// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/scenefile/placement_file.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// Places objects in objects, and objects in great numbers, which all stand still. Files of placements are read
/// straight into what rays go by. InputError at the placement for what moves, leaves the range of floats, or would have
/// more ways from the scene to a shape than have names.
class PlacementBuilder {
 public:
  /// objects: the traced object of each definition. moving: of a traced object, where what moves or deforms in it
  /// stands in the file; null: nothing.
  PlacementBuilder(const BuildContext& context, const std::vector<uint32_t>& objects,
                   std::function<const FileLoc*(uint32_t)> moving, trace::TracedScene* traced)
      : context_(context), objects_(objects), moving_(std::move(moving)), traced_(*traced) {}

  /// When definitions have their own shapes: all that stands in definitions, and in the scene what no instance of
  /// Embree can be. skip: which of the scene's instances are left out.
  void place_all(const std::vector<bool>& skip);
  /// Of all in the scene.
  float reach() const { return reach_; }
  const FileLoc& narrowest() const { return narrowest_; }
  /// Of the files' placements; 0 without any.
  uint64_t fingerprint() const { return fingerprint_; }

 private:
  static constexpr int32_t in_scene = -1;
  void place_in_object(int32_t object);
  void place(const std::vector<scenefile::InstanceEntity>& instances, const std::vector<bool>* skip, int32_t owner);
  void place(const scenefile::PlacementsEntity& placements, int32_t owner);
  void check_still(int32_t object, const FileLoc& loc) const;
  float checked_reach(int32_t object, const float rows[3][4], const FileLoc& loc, const std::string& which) const;
  void check_paths(int32_t object, uint64_t placements, int32_t owner, const FileLoc& loc) const;
  uint32_t traced_object(int32_t owner) const;
  uint32_t add_singles(uint32_t object, trace::PlacementSet set, const FileLoc& loc);
  void add(int32_t object, trace::PlacementSet set, int32_t owner, const FileLoc& loc);
  V3d origin(int32_t owner) const;

  const BuildContext& context_;
  const std::vector<uint32_t>& objects_;
  const std::function<const FileLoc*(uint32_t)> moving_;
  trace::TracedScene& traced_;
  std::vector<uint8_t> placed_;
  float reach_ = infinity;
  FileLoc narrowest_;
  uint64_t fingerprint_ = 0;
};

/// Visits all that a list of the scene or of a definition places.
template <class Visit>
void for_each_placed(const scenefile::SceneDescription& d, int32_t owner, const Visit& visit) {
  const auto& instances = owner < 0 ? d.instances : d.objects[size_t(owner)].instances;
  const auto& placements = owner < 0 ? d.placements : d.objects[size_t(owner)].placements;
  for (const auto& i : instances) visit(i.object);
  for (const auto& p : placements) visit(p.object);
}

}  // namespace dapple::build
