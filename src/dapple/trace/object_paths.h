// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <vector>

#include "dapple/trace/traced_scene.h"

namespace dapple::trace {

/// The paths of a scene's placements by the object that they lead to: so what is placed seldom is found among billions
/// of others. Takes time and memory by sets of placements, not by paths. The scene must be committed and outlive it.
class ObjectPaths {
 public:
  explicit ObjectPaths(const TracedScene& scene);

  /// Objects that paths lead to, ascending.
  const std::vector<uint32_t>& objects() const { return objects_; }
  uint64_t count(uint32_t object) const { return total(no_id, object); }
  /// Path number i < count(object) that leads to an object, as an instance of the scene.
  uint32_t instance(uint32_t object, uint64_t i) const;

 private:
  using Set = PlacementTree::Set;
  /// Paths to an object that go through a set; before: those through sets that come earlier.
  struct Way {
    const Set* set;
    uint64_t before;
  };
  struct Ways {
    std::vector<Way> ways;
    uint64_t total = 0;
  };
  using Space = std::map<uint32_t, Ways>;
  const Space& survey(const PlacementTree& tree, uint32_t owner);
  uint64_t total(uint32_t owner, uint32_t object) const;

  std::map<uint32_t, Space> spaces_;
  std::vector<uint32_t> objects_;
};

}  // namespace dapple::trace
