// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/placement_tree.h"

#include <algorithm>
#include <string>

#include "dapple/base/error.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::trace {

namespace {

[[noreturn]] void throw_too_many() {
  throw Error(ExitCode::bad_input,
              "ray tracing: objects are placed in more than " + std::to_string(PlacementTree::most_paths) + " ways");
}

}  // namespace

PlacementTree::Space& PlacementTree::space(uint32_t owner) {
  if (owner == no_id) return scene_;
  if (owner >= objects_.size()) objects_.resize(size_t(owner) + 1);
  return objects_[owner];
}

const PlacementTree::Space* PlacementTree::find(uint32_t owner) const {
  if (owner == no_id) return &scene_;
  return owner < objects_.size() ? &objects_[owner] : nullptr;
}

uint64_t PlacementTree::paths(uint32_t owner) const {
  const Space* s = find(owner);
  return (s ? s->paths : 0) + (owner == no_id ? 0 : 1);
}

int PlacementTree::levels(uint32_t owner) const {
  const Space* s = find(owner);
  return s ? s->levels : 0;
}

std::vector<const PlacementTree::Set*> PlacementTree::sets_of(uint32_t owner) const {
  std::vector<const Set*> out;
  if (const Space* s = find(owner))
    for (const uint32_t set : s->sets) out.push_back(sets_[set].get());
  return out;
}

const PlacementTree::Set& PlacementTree::add(PlacementSet placements, uint32_t object, uint32_t owner) {
  const uint64_t each = paths(object), before = paths(owner), all = each * placements.size();
  if (all + before > most_paths) throw_too_many();
  const int its_levels = levels(object) + 1;
  if (its_levels > most_levels) throw Error(ExitCode::bad_input, "ray tracing: more than four levels of objects");
  Space& s = space(owner);
  s.sets.push_back(uint32_t(sets_.size()));
  s.paths += all;
  s.levels = std::max(s.levels, its_levels);
  sets_.push_back(std::make_unique<Set>(Set{std::move(placements), object, uint32_t(before), uint32_t(each)}));
  return *sets_.back();
}

void PlacementTree::count_from(uint32_t first) {
  if (first + scene_.paths > most_paths) throw_too_many();
  for (const uint32_t set : scene_.sets) sets_[set]->first += first;
}

template <class Visit>
uint32_t PlacementTree::follow(uint32_t path, const Visit& visit) const {
  const Space* at = &scene_;
  for (;;) {
    const auto after = std::upper_bound(at->sets.begin(), at->sets.end(), path,
                                        [this](uint32_t p, uint32_t set) { return p < sets_[set]->first; });
    const Set& set = *sets_[*(after - 1)];
    visit(set, (path - set.first) / set.paths);
    path = (path - set.first) % set.paths;
    if (path == 0) return set.object;
    at = &objects_[set.object];
  }
}

uint32_t PlacementTree::object_of(uint32_t path) const {
  return follow(path, [](const Set&, uint32_t) {});
}

// In double: the map of a path is rounded once, as that of an instance is.
Instance PlacementTree::instance(uint32_t path) const {
  double whole[3][4];
  bool is_first = true;
  Instance out{};
  out.object = follow(path, [&](const Set& set, uint32_t i) {
    float m[3][4];
    set.placements.rows(i, m);
    double product[3][4];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c)
        product[r][c] = is_first ? double(m[r][c])
                                 : whole[r][0] * double(m[0][c]) + whole[r][1] * double(m[1][c]) +
                                       whole[r][2] * double(m[2][c]) + (c == 3 ? whole[r][3] : 0);
    std::copy_n(&product[0][0], 12, &whole[0][0]);
    is_first = false;
  });
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out.m[r][c] = float(whole[r][c]);
  out.scale = largest_scale(out.m);
  return out;
}

size_t PlacementTree::bytes() const {
  size_t sum = 0;
  for (const auto& set : sets_) sum += set->placements.bytes();
  return sum;
}

}  // namespace dapple::trace
