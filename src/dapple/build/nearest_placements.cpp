// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/nearest_placements.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <queue>

#include "dapple/build/placement_builder.h"
#include "dapple/scenefile/placement_file.h"

namespace dapple::build {

using scenefile::exact_placement;
using scenefile::ExactPlacement;
using scenefile::InstanceEntity;
using scenefile::PlacementFile;
using scenefile::PlacementRows;
using scenefile::PlacementsEntity;

namespace {

// Of all objects together: seconds, and some hundred megabytes.
constexpr size_t most_looked_at = size_t(1) << 25, least_looked_at = size_t(1) << 15, most_open = size_t(1) << 20;
constexpr size_t kept_placements = PlacementFile::block;  // of a file: more are read again where they are needed
constexpr size_t most_open_files = 64;
constexpr float close_enough = 1 - 1e-3f;  // of widths of pixels: below, none is looked for

/// Where points of an object come to lie, and by how much it grows on the way, at most.
struct Reach {
  V3d centre{0, 0, 0};
  double radius = -1, scale = 0;  // radius below 0: nothing

  void add(const Reach& other) {
    if (other.radius < 0) return;
    scale = std::max(scale, other.scale);
    const V3d off = other.centre - centre;
    const double distance = off.length();
    if (radius < 0 || distance + radius <= other.radius) {
      centre = other.centre, radius = other.radius;
    } else if (distance + other.radius > radius) {
      const double whole = (radius + distance + other.radius) / 2;
      centre += off * ((whole - radius) / distance);
      radius = whole;
    }
  }
};

double largest_scale(const M44d& m) {
  double most = 0;
  for (int j = 0; j < 3; ++j) most = std::max(most, V3d(m[0][j], m[1][j], m[2][j]).length());
  return most;
}

/// A map in twelve numbers, as queues hold many.
struct Map {
  ExactPlacement m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  V3d point(const V3d& p) const {
    V3d q;
    for (size_t r = 0; r < 3; ++r) q[int(r)] = m[4 * r] * p.x + m[4 * r + 1] * p.y + m[4 * r + 2] * p.z + m[4 * r + 3];
    return q;
  }
  // No vector becomes longer by more: M^T M has no eigenvalue above the largest sum of a row. Of turns and even scales
  // it is the scale.
  double stretch() const {
    double most = 0;
    for (size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (size_t j = 0; j < 3; ++j) sum += std::abs(m[i] * m[j] + m[4 + i] * m[4 + j] + m[8 + i] * m[8 + j]);
      most = std::max(most, sum);
    }
    return std::sqrt(most);
  }
  Reach apply(const Reach& r) const {
    const double most = stretch();
    return {point(r.centre), r.radius < 0 ? -1 : most * r.radius, most * r.scale};
  }
  Map operator*(const ExactPlacement& b) const {
    Map out;
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 4; ++c)
        out.m[4 * r + c] =
            m[4 * r] * b[c] + m[4 * r + 1] * b[4 + c] + m[4 * r + 2] * b[8 + c] + (c == 3 ? m[4 * r + 3] : 0);
    return out;
  }
  Transform transform() const {
    M44d out;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) out[r][c] = m[size_t(4 * r + c)];
    return Transform(out);
  }
};

ExactPlacement rows_of(const Transform& t) {
  ExactPlacement out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out[size_t(4 * r + c)] = t.matrix()[r][c];
  return out;
}

bool is_finite(const ExactPlacement& m) {
  return std::all_of(m.begin(), m.end(), [](double x) { return std::isfinite(x); });
}

class Search {
 public:
  Search(const BuildContext& context, const std::vector<uint8_t>& wanted, const CameraView& view,
         const std::vector<Imath::Box3d>& bounds)
      : context_(context),
        d_(context.description),
        wanted_(wanted),
        view_(view),
        bounds_(bounds),
        spaces_(wanted.size() + 1) {}

  std::vector<std::vector<Transform>> all() {
    std::vector<std::vector<Transform>> out(wanted_.size());
    if (std::find(wanted_.begin(), wanted_.end(), 1) == wanted_.end()) return out;
    survey(in_scene);
    for (size_t w = 0; w < wanted_.size(); ++w)
      if (wanted_[w] && space(in_scene).reach.count(int32_t(w)) > 0) out[w] = find(int32_t(w));
    return out;
  }

 private:
  static constexpr int32_t in_scene = -1;
  /// Placements that are looked at together.
  struct Block {
    Reach places;  ///< of the middle of what is wanted of the object
    size_t chunk;  ///< of the file
    uint64_t first;
    size_t count;
  };
  /// Placements of one object by one directive, or by all instances of one space.
  struct Group {
    int32_t object;
    const PlacementsEntity* file = nullptr;
    std::vector<ExactPlacement> kept;       ///< of instances, and of small files
    std::unique_ptr<PlacementFile> open{};  ///< of a large file, at times
    Reach middle{};                         ///< of all that is wanted, in the object's space
    std::vector<Block> blocks{};
  };
  struct Space {
    bool is_surveyed = false;
    std::vector<Group> groups;
    std::map<int32_t, Reach> reach;  ///< of what is wanted and stands in it
  };
  /// What is still to be looked at: what stands at a place of a space, or a block of a group.
  struct Open {
    float least;
    uint64_t order;  ///< of equal ones the last comes first, which stands the deepest
    Map map;
    int32_t object;
    Group* group;
    uint32_t block;
    bool operator<(const Open& other) const { return least != other.least ? least > other.least : order < other.order; }
  };
  struct Found {
    float width;
    Map map;
  };

  Space& space(int32_t owner) { return spaces_[size_t(owner + 1)]; }
  void survey(int32_t owner);
  void survey_group(Group* group);
  void add_block(Group* group, size_t chunk, uint64_t first, const std::vector<ExactPlacement>& rows);
  PlacementFile& opened(Group* group);
  std::vector<ExactPlacement> rows_of_block(Group* group, const Block& block);

  std::vector<Transform> find(int32_t object);
  Reach ball_of(int32_t object) const;
  float least_width(const Reach& in_world) const;
  size_t look_at(const Open& open, int32_t object);
  void push(const Map& map, int32_t space_object, Group* group, uint32_t block, const Reach& reach);
  void found(const Map& map, int32_t object);
  Reach within(const Group& group, const Block& block, int32_t object);
  float worst() const { return found_.size() < InstancesView::most_placements ? infinity : found_.back().width; }

  const BuildContext& context_;
  const scenefile::SceneDescription& d_;
  const std::vector<uint8_t>& wanted_;
  const CameraView& view_;
  const std::vector<Imath::Box3d>& bounds_;
  std::vector<Space> spaces_;
  std::vector<Group*> open_files_;
  std::priority_queue<Open> open_;
  std::vector<Found> found_;
  uint64_t pushed_ = 0;
  bool gave_up_ = false;
};

void Search::survey(int32_t owner) {
  Space& s = space(owner);
  if (s.is_surveyed) return;
  s.is_surveyed = true;
  if (owner != in_scene && wanted_[size_t(owner)]) s.reach[owner] = ball_of(owner);
  for_each_placed(d_, owner, [this](int32_t inner) { survey(inner); });
  std::map<int32_t, Group> by_object;
  for (const InstanceEntity& i : owner == in_scene ? d_.instances : d_.objects[size_t(owner)].instances) {
    if (!i.is_shown() || space(i.object).reach.empty()) continue;
    if (owner == in_scene && !d_.objects[size_t(i.object)].holds_objects()) continue;
    Group& group = by_object.try_emplace(i.object, Group{i.object, nullptr, {}}).first->second;
    group.kept.push_back(rows_of(i.transform.exact().start));
  }
  for (auto& [object, group] : by_object) s.groups.push_back(std::move(group));
  for (const PlacementsEntity& p : owner == in_scene ? d_.placements : d_.objects[size_t(owner)].placements)
    if (!space(p.object).reach.empty()) s.groups.push_back({p.object, &p, {}});
  for (Group& group : s.groups) {
    survey_group(&group);
    for (const auto& [object, inner] : space(group.object).reach)
      for (const Block& block : group.blocks) s.reach[object].add(within(group, block, object));
  }
}

void Search::survey_group(Group* group) {
  for (const auto& [object, reach] : space(group->object).reach) group->middle.add(reach);
  if (!group->file) {
    for (size_t first = 0; first < group->kept.size(); first += PlacementFile::block)
      add_block(group, 0, first,
                {group->kept.begin() + std::ptrdiff_t(first),
                 group->kept.begin() + std::ptrdiff_t(std::min(first + PlacementFile::block, group->kept.size()))});
    return;
  }
  const Map outer{rows_of(group->file->transform)};
  PlacementFile& file = opened(group);
  const bool keeps = file.size() <= kept_placements;
  size_t chunk = 0;
  for (const PlacementFile::Chunk& c : file.chunks()) {
    std::vector<PlacementRows> rows;
    for (uint64_t first = 0; first < c.size; first += PlacementFile::block) {
      rows.resize(size_t(std::min<uint64_t>(PlacementFile::block, c.size - first)));
      file.read(c, first, rows);
      std::vector<ExactPlacement> exact;
      for (const PlacementRows& m : rows) exact.push_back((outer * exact_placement(m, c.origin)).m);
      add_block(group, chunk, keeps ? group->kept.size() : first, exact);
      if (keeps) group->kept.insert(group->kept.end(), exact.begin(), exact.end());
    }
    ++chunk;
  }
  if (keeps) group->open.reset(), open_files_.pop_back();
}

void Search::add_block(Group* group, size_t chunk, uint64_t first, const std::vector<ExactPlacement>& rows) {
  Imath::Box3d box;
  double scale = 0;
  for (const ExactPlacement& m : rows) {
    if (!is_finite(m)) continue;  // refused where it is built
    box.extendBy(Map{m}.point(group->middle.centre));
    scale = std::max(scale, Map{m}.stretch());
  }
  if (!box.isEmpty())
    group->blocks.push_back({{box.center(), (box.max - box.min).length() / 2, scale}, chunk, first, rows.size()});
}

PlacementFile& Search::opened(Group* group) {
  if (!group->open) {
    if (open_files_.size() == most_open_files)
      open_files_.front()->open.reset(), open_files_.erase(open_files_.begin());
    group->open = std::make_unique<PlacementFile>(d_.resolve(group->file->filename), group->file->loc);
    open_files_.push_back(group);
  }
  return *group->open;
}

std::vector<ExactPlacement> Search::rows_of_block(Group* group, const Block& block) {
  std::vector<ExactPlacement> out;
  if (!group->kept.empty()) {
    const auto begin = group->kept.begin() + std::ptrdiff_t(block.first);
    return {begin, begin + std::ptrdiff_t(block.count)};
  }
  const Map outer{rows_of(group->file->transform)};
  const PlacementFile& file = opened(group);
  if (block.chunk >= file.chunks().size() || block.first + block.count > file.chunks()[block.chunk].size)
    throw InputError(group->file->loc, group->file->filename + " has changed while it was read");
  const PlacementFile::Chunk& chunk = file.chunks()[block.chunk];
  std::vector<PlacementRows> rows(block.count);
  file.read(chunk, block.first, rows);
  for (const PlacementRows& m : rows) out.push_back((outer * exact_placement(m, chunk.origin)).m);
  return out;
}

// Of what is wanted, in its own space.
Reach Search::ball_of(int32_t object) const {
  const auto i = size_t(object);
  if (i >= bounds_.size() || bounds_[i].isEmpty()) return {context_.origins.objects[i], 0, 1};
  return {bounds_[i].center(), (bounds_[i].max - bounds_[i].min).length() / 2, 1};
}

// Of an object's places in a block.
Reach Search::within(const Group& group, const Block& block, int32_t object) {
  const Reach& inner = space(group.object).reach.at(object);
  const double off = inner.radius + (inner.centre - group.middle.centre).length();
  return {block.places.centre, block.places.radius + block.places.scale * off, block.places.scale * inner.scale};
}

float Search::least_width(const Reach& r) const {
  const V3d centre = r.centre - context_.origins.scene;
  return view_.least_width(V3f(centre), float(r.radius + 1e-6 * centre.length())) / float(r.scale);
}

void Search::push(const Map& map, int32_t object, Group* group, uint32_t block, const Reach& reach) {
  const float least = least_width(reach);
  if (!(least < worst() * close_enough)) return;
  if (open_.size() >= most_open)
    gave_up_ = true;
  else
    open_.push({least, pushed_++, map, object, group, block});
}

void Search::found(const Map& map, int32_t object) {
  const Transform t = with_base(context_.origins.in_world(map.transform()), context_.origins.objects[size_t(object)]);
  const Reach ball = ball_of(object);
  const V3f centre = t.point(V3f(ball.centre - context_.origins.objects[size_t(object)]));
  const auto scale = float(largest_scale(t.matrix()));
  const Found f{view_.least_width(centre, float(ball.radius) * scale) / scale, map};
  if (!(f.width < worst())) return;
  if (found_.size() == InstancesView::most_placements) found_.pop_back();
  const auto after = std::upper_bound(found_.begin(), found_.end(), f,
                                      [](const Found& a, const Found& b) { return a.width < b.width; });
  found_.insert(after, f);
}

// Returns how many placements these were.
size_t Search::look_at(const Open& open, int32_t object) {
  if (!open.group) {
    if (open.object == object) found(open.map, object);  // nothing holds itself
    for (Group& group : space(open.object).groups) {
      if (space(group.object).reach.count(object) == 0) continue;
      for (size_t b = 0; b < group.blocks.size(); ++b)
        push(open.map, group.object, &group, uint32_t(b), open.map.apply(within(group, group.blocks[b], object)));
    }
    return 0;
  }
  const Reach& inner = space(open.object).reach.at(object);
  for (const ExactPlacement& m : rows_of_block(open.group, open.group->blocks[open.block])) {
    if (!is_finite(m)) continue;
    const Map map = open.map * m;
    push(map, open.object, nullptr, 0, map.apply(inner));
  }
  return open.group->blocks[open.block].count;
}

std::vector<Transform> Search::find(int32_t object) {
  found_.clear(), open_ = {};
  const auto others = size_t(std::count(wanted_.begin(), wanted_.end(), 1));
  const size_t most = std::max(most_looked_at / others, least_looked_at);
  size_t looked_at = 0;
  push(Map(), in_scene, nullptr, 0, space(in_scene).reach.at(object));
  while (!open_.empty() && open_.top().least < worst() * close_enough) {
    if (looked_at > most) {
      gave_up_ = true;
      break;
    }
    const Open next = open_.top();
    open_.pop();
    looked_at += look_at(next, object);
  }
  if (gave_up_)
    context_.diagnostics.warn(d_.objects[size_t(object)].loc,
                              "object \"" + d_.objects[size_t(object)].name +
                                  "\" stands in so many places that the nearest to the camera may not be among those "
                                  "that say how finely its surfaces are diced",
                              "nearest placements");
  std::vector<Transform> out;
  for (const Found& f : found_)
    out.push_back(with_base(context_.origins.in_world(f.map.transform()), context_.origins.objects[size_t(object)]));
  return out;
}

}  // namespace

std::vector<std::vector<Transform>> nearest_placements(const BuildContext& context, const std::vector<uint8_t>& wanted,
                                                       const CameraView& view,
                                                       const std::vector<Imath::Box3d>& bounds) {
  return Search(context, wanted, view, bounds).all();
}

}  // namespace dapple::build
