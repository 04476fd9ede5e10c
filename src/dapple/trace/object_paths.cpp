// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/object_paths.h"

#include <algorithm>

namespace dapple::trace {

ObjectPaths::ObjectPaths(const TracedScene& scene) {
  for (const auto& [object, ways] : survey(scene.placements(), no_id)) objects_.push_back(object);
}

const ObjectPaths::Space& ObjectPaths::survey(const PlacementTree& tree, uint32_t owner) {
  const auto [at, is_new] = spaces_.try_emplace(owner);
  Space& space = at->second;
  if (!is_new) return space;
  for (const Set* set : tree.sets_of(owner)) {
    const auto add = [&](uint32_t object, uint64_t each) {
      Ways& to = space[object];
      to.ways.push_back({set, to.total});
      to.total += each * set->placements.size();
    };
    add(set->object, 1);  // nothing holds itself
    for (const auto& [object, ways] : survey(tree, set->object)) add(object, ways.total);
  }
  return space;
}

uint64_t ObjectPaths::total(uint32_t owner, uint32_t object) const {
  const auto space = spaces_.find(owner);
  if (space == spaces_.end()) return 0;
  const auto ways = space->second.find(object);
  return ways == space->second.end() ? 0 : ways->second.total;
}

uint32_t ObjectPaths::instance(uint32_t object, uint64_t i) const {
  uint32_t owner = no_id, number = 0;
  for (;;) {
    const std::vector<Way>& ways = spaces_.at(owner).at(object).ways;
    const Way& way =
        *(std::upper_bound(ways.begin(), ways.end(), i,
                           [](uint64_t number_of_path, const Way& w) { return number_of_path < w.before; }) -
          1);
    const bool is_there = way.set->object == object;
    const uint64_t each = is_there ? 1 : total(way.set->object, object);
    i -= way.before;
    number += way.set->first + uint32_t(i / each) * way.set->paths;
    if (is_there) return number;
    owner = way.set->object, i %= each;
  }
}

}  // namespace dapple::trace
