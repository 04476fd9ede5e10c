// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/trace/instance.h"
#include "dapple/trace/placement_set.h"

namespace dapple::trace {

/// Objects placed in objects, to any number: what a scene has beside the instances that Embree knows.
///
/// A path leads from the scene through one placement after the other to the own shapes of an object. Paths have
/// numbers: those from an object on are counted from 0, which is the object itself, then those through its sets, one
/// set after the other and one placement after the other; each has as many as its own object. So the paths of a whole
/// forest are named by 32 bits, and what a number means is found by a division a level. In the scene they follow its
/// instances. Shapes on a path are an instance to all who ask.
class PlacementTree {
 public:
  static constexpr int most_levels = 4;
  static constexpr uint64_t most_paths = 0xffff0000;

  struct Set {
    PlacementSet placements;
    uint32_t object;
    uint32_t first;  ///< path of the first, from the space in which the set lies
    uint32_t paths;  ///< of each
  };

  /// Adds a set to an object, or to the scene (no_id). To `object` nothing may be added afterwards. Throws Error where
  /// there would be more than most_paths or most_levels.
  const Set& add(PlacementSet placements, uint32_t object, uint32_t owner);
  /// After the last set: paths of the scene are counted from `first`.
  void count_from(uint32_t first);

  bool is_empty() const { return sets_.empty(); }
  /// From an object on, itself included; of the scene those of its sets.
  uint64_t paths(uint32_t owner) const;
  /// Placements from an object on; 0: it has no sets.
  int levels(uint32_t owner) const;
  /// The sets of an object or of the scene.
  std::vector<const Set*> sets_of(uint32_t owner) const;
  /// The path's whole map, and its object. The number is one of those of the scene.
  Instance instance(uint32_t path) const;
  uint32_t object_of(uint32_t path) const;
  size_t bytes() const;

 private:
  struct Space {
    std::vector<uint32_t> sets;
    uint64_t paths = 0;
    int levels = 0;
  };
  Space& space(uint32_t owner);
  const Space* find(uint32_t owner) const;
  template <class Visit>
  uint32_t follow(uint32_t path, const Visit& visit) const;

  std::vector<std::unique_ptr<Set>> sets_;
  Space scene_;
  std::vector<Space> objects_;
};

}  // namespace dapple::trace
