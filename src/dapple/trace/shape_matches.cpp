// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/shape_matches.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <tuple>

#include "dapple/base/hash.h"

namespace dapple::trace {

namespace {

/// What shapes that correspond have in common: identity or name of the object (Objects), kind, primitives, and how
/// these are joined.
using ShapeKind = std::tuple<uint64_t, size_t, size_t, uint64_t>;

template <class T>
uint64_t digest(uint64_t seed, const std::vector<T>& values) {
  return hash_bytes({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)}, seed);
}

ShapeKind kind_of(const Shape& shape, uint64_t identity) {
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
  return {identity, shape.index(), parts, joined};
}

/// Kinds of the shapes of an object, or of several.
using Kinds = std::multiset<ShapeKind>;

void add_kinds(const TracedScene& scene, uint32_t object, Kinds* kinds) {
  for (const uint32_t g : scene.geometries_in(object)) kinds->insert(kind_of(scene.shape(g), 0));
}

/// Whether objects of one name may be the same thing: exporters number definitions, and the numbers change when one is
/// added. Half of the shapes suffices, since a thing may get a part.
bool are_alike(const Kinds& a, const Kinds& b) {
  std::vector<ShapeKind> common;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
  return 2 * common.size() >= std::max(a.size(), b.size());
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

using Place = ShapeMatches::Place;

template <class Kind, class Member>
using Groups = std::map<Kind, std::vector<Member>>;

/// How objects are placed.
struct Objects {
  std::vector<uint32_t> instance;  ///< the only one, which counts like none; no_id: there is none, or many
  std::vector<uint32_t> identity;  ///< of those of none or many, the same in both scenes; no_id: it is not known
  std::vector<uint64_t> name;      ///< of those of one that both scenes name, have once, and have alike; else 0

  explicit Objects(const TracedScene& scene)
      : instance(scene.object_count(), no_id), identity(instance), name(instance.size()) {
    std::vector<uint32_t> count(scene.object_count());
    for (uint32_t i = 0; i < scene.single_count(); ++i) ++count[scene.object_of(i)], instance[scene.object_of(i)] = i;
    std::vector<bool> is_owned(scene.object_count());
    const auto note = [&](uint32_t owner) {
      for (const PlacementTree::Set* set : scene.placements().sets_of(owner)) is_owned[set->object] = true;
    };
    note(no_id);
    for (uint32_t o = 0; o < instance.size(); ++o) note(o);
    for (uint32_t o = 0; o < instance.size(); ++o)
      if (count[o] != 1 || is_owned[o] || !scene.placements().sets_of(o).empty()) instance[o] = no_id;
  }
  bool is_known(uint32_t object) const { return instance[object] != no_id || identity[object] != no_id; }
  /// Known as `id` from here on, by instances.
  void know(uint32_t object, uint32_t id) { identity[object] = id, instance[object] = no_id; }
  /// Names of which all objects are placed once.
  std::set<uint64_t> names_once(const ItemNames::Digests& names) const {
    std::set<uint64_t> once, more;
    for (const auto& [object, digest] : names) (instance[object] != no_id ? once : more).insert(digest);
    for (const uint64_t digest : more) once.erase(digest);
    return once;
  }
  void take_names(const ItemNames::Digests& names, const std::set<uint64_t>& chosen) {
    for (const auto& [object, digest] : names)
      if (chosen.contains(digest)) name[object] = digest;
  }
};

/// The objects of each digest of their shapes.
std::map<uint64_t, std::vector<uint32_t>> objects_by_shapes(const TracedScene& scene) {
  std::map<uint64_t, std::vector<uint32_t>> objects;
  for (uint32_t o = 0; o < scene.object_count(); ++o) {
    uint64_t all = 0;
    for (const uint32_t g : scene.geometries_in(o)) all = hash(all, key_of(scene.shape(g)));
    objects[all].push_back(o);
  }
  return objects;
}

/// The first object of each name.
std::map<uint64_t, uint32_t> objects_by_name(const TracedScene& scene) {
  std::map<uint64_t, uint32_t> numbers;
  for (const auto& [object, name] : scene.names().objects()) {
    const auto [at, is_new] = numbers.emplace(name, object);
    if (!is_new) at->second = std::min(at->second, object);
  }
  return numbers;
}

/// Of the objects of each name together.
std::map<uint64_t, Kinds> kinds_by_name(const TracedScene& scene) {
  std::map<uint64_t, Kinds> kinds;
  for (const auto& [object, name] : scene.names().objects()) add_kinds(scene, object, &kinds[name]);
  return kinds;
}

/// Which object there is that of this scene; no_id: none. By name, if they are alike, or else those of equal shapes, if
/// these are equally many.
std::vector<uint32_t> object_pairs(const TracedScene& here, const TracedScene& there) {
  std::vector<uint32_t> pairs(here.object_count(), no_id);
  std::vector<bool> is_taken(there.object_count());
  const auto named_there = objects_by_name(there);
  for (const auto& [name, object] : objects_by_name(here)) {
    const auto found = named_there.find(name);
    if (found == named_there.end()) continue;
    Kinds kinds, kinds_there;
    add_kinds(here, object, &kinds), add_kinds(there, found->second, &kinds_there);
    if (are_alike(kinds, kinds_there)) pairs[object] = found->second, is_taken[found->second] = true;
  }
  auto of_here = objects_by_shapes(here), of_there = objects_by_shapes(there);
  for (auto& [shapes, objects] : of_here) {
    std::vector<uint32_t>& equal = of_there[shapes];
    std::erase_if(objects, [&](uint32_t o) { return pairs[o] != no_id; });
    std::erase_if(equal, [&](uint32_t o) { return is_taken[o]; });
    if (equal.size() != objects.size()) continue;
    for (size_t k = 0; k < objects.size(); ++k) pairs[objects[k]] = equal[k];
  }
  return pairs;
}

Groups<ShapeKind, Place> shapes_of(const TracedScene& scene, const Objects& objects) {
  Groups<ShapeKind, Place> groups;
  const auto add = [&](uint32_t object) {
    const uint32_t instance = object == no_id ? no_id : objects.instance[object];
    if (object != no_id && !objects.is_known(object)) return;
    uint64_t identity = object == no_id ? no_id : objects.identity[object];
    if (object != no_id && objects.name[object] != 0) identity = objects.name[object];
    for (const uint32_t g : scene.geometries_in(object))
      groups[kind_of(scene.shape(g), identity)].push_back({g, instance});
  };
  add(no_id);
  for (uint32_t object = 0; object < scene.object_count(); ++object) add(object);
  // Geometries have the order of the file.
  for (auto& [kind, places] : groups)
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.geometry < b.geometry; });
  return groups;
}

Groups<uint32_t, uint32_t> instances_of(const TracedScene& scene, const Objects& objects) {
  Groups<uint32_t, uint32_t> groups;
  for (uint32_t i = 0; i < scene.single_count(); ++i)
    if (const uint32_t object = scene.object_of(i); objects.identity[object] != no_id)
      groups[objects.identity[object]].push_back(i);
  return groups;
}

/// Of an instance's map when the shutter opens and when it closes.
uint64_t key_of(const TracedScene& scene, uint32_t instance) {
  std::vector<float> rows(24);
  for (const int end : {0, 1}) {
    float m[3][4];
    scene.instance_rows(instance, float(end), m);
    std::memcpy(&rows[size_t(12 * end)], m, sizeof m);
  }
  return digest(0, rows);
}

/// How members of a group are told apart: by their names' digests, 0 where they have none, or by a key that is equal
/// for equal ones. Of this scene or the other.
template <class Member>
struct Identity {
  std::function<uint64_t(bool is_here, const Member&)> name, key;
};

/// Calls found(member, other) in their order, if there are equally many, else for those that are equal.
template <class Member, class Found>
void match_in_order(const std::vector<Member>& members, const std::vector<Member>& others,
                    const Identity<Member>& identity, const Found& found) {
  if (members.size() == others.size()) {
    for (size_t k = 0; k < members.size(); ++k) found(members[k], others[k]);
    return;
  }
  Groups<uint64_t, Member> equal;
  for (auto other = others.rbegin(); other != others.rend(); ++other)
    equal[identity.key(false, *other)].push_back(*other);
  for (const Member& member : members) {
    const auto at = equal.find(identity.key(true, member));
    if (at == equal.end() || at->second.empty()) continue;
    found(member, at->second.back());
    at->second.pop_back();
  }
}

/// Matches what has the same name, and takes all that has a name out of groups that both have names.
template <class Member, class Found>
void match_names(std::vector<Member>* members, std::vector<Member>* others, const Identity<Member>& identity,
                 const Found& found) {
  const auto by_name = [&](bool is_here, const std::vector<Member>& all) {
    Groups<uint64_t, Member> named;
    for (const Member& m : all)
      if (const uint64_t name = identity.name(is_here, m); name != 0) named[name].push_back(m);
    return named;
  };
  const Groups<uint64_t, Member> named = by_name(true, *members), named_there = by_name(false, *others);
  if (named.empty() || named_there.empty()) return;
  for (const auto& [name, same] : named)
    if (const auto at = named_there.find(name); at != named_there.end())
      match_in_order(same, at->second, identity, found);
  std::erase_if(*members, [&](const Member& m) { return identity.name(true, m) != 0; });
  std::erase_if(*others, [&](const Member& m) { return identity.name(false, m) != 0; });
}

/// Within each group by name, then in order.
template <class Kind, class Member, class Found>
void match(Groups<Kind, Member> here, Groups<Kind, Member> there, const Identity<Member>& identity,
           const Found& found) {
  for (auto& [kind, members] : here) {
    const auto group = there.find(kind);
    if (group == there.end()) continue;
    match_names(&members, &group->second, identity, found);
    match_in_order(members, group->second, identity, found);
  }
}

uint64_t name_in(const ItemNames::Digests& names, uint32_t number) {
  const auto at = names.find(number);
  return at == names.end() ? 0 : at->second;
}

bool same_placements(const TracedScene& a, const TracedScene& b, const std::vector<uint32_t>& pairs) {
  const auto same = [&](uint32_t owner, uint32_t owner_there) {
    const auto of_a = a.placements().sets_of(owner), of_b = b.placements().sets_of(owner_there);
    if (of_a.size() != of_b.size()) return false;
    for (size_t s = 0; s < of_a.size(); ++s) {
      const PlacementSet &x = of_a[s]->placements, &y = of_b[s]->placements;
      if (pairs[of_a[s]->object] != of_b[s]->object || x.size() != y.size() ||
          (x.size() > 0 &&
           std::memcmp(x.blocks().data(), y.blocks().data(), x.blocks().size() * sizeof(PlacementSet::Block)) != 0))
        return false;
    }
    return true;
  };
  if (!same(no_id, no_id)) return false;
  for (uint32_t object = 0; object < a.object_count(); ++object)
    if (pairs[object] == no_id ? !a.placements().sets_of(object).empty() : !same(object, pairs[object])) return false;
  return true;
}

}  // namespace

ShapeMatches::ShapeMatches(const TracedScene& here, const TracedScene& there)
    : place_(here.geometry_count()),
      instance_(here.single_count(), no_id),
      single_(here.single_count()),
      placed_(here.instance_count() - here.single_count()),
      first_placed_there_(there.single_count()) {
  Objects of_here(here), of_there(there);
  const std::vector<uint32_t> pairs = object_pairs(here, there);
  for (uint32_t o = 0; o < pairs.size(); ++o) {
    if (pairs[o] == no_id || (of_here.instance[o] != no_id && of_there.instance[pairs[o]] != no_id)) continue;
    of_here.know(o, o), of_there.know(pairs[o], o);
  }
  const auto &names_here = here.names().objects(), &names_there = there.names().objects();
  std::set<uint64_t> once = of_here.names_once(names_here);
  const std::set<uint64_t> once_there = of_there.names_once(names_there);
  const auto kinds = kinds_by_name(here), kinds_there = kinds_by_name(there);
  std::erase_if(once, [&](uint64_t name) {
    return !once_there.contains(name) || !are_alike(kinds.at(name), kinds_there.at(name));
  });
  of_here.take_names(names_here, once), of_there.take_names(names_there, once);
  same_placements_ = same_placements(here, there, pairs);
  for (const uint32_t i : of_here.instance)
    if (i != no_id) single_[i] = true;
  const auto scene = [&](bool is_here) -> const TracedScene& { return is_here ? here : there; };
  match(shapes_of(here, of_here), shapes_of(there, of_there),
        Identity<Place>{
            [&](bool is_here, const Place& p) { return name_in(scene(is_here).names().shapes(), p.geometry); },
            [&](bool is_here, const Place& p) {
              const uint64_t shape = key_of(scene(is_here).shape(p.geometry));
              return p.instance == no_id ? shape : hash(shape, key_of(scene(is_here), p.instance));
            }},
        [&](const Place& a, const Place& b) { place_[a.geometry] = b; });
  match(instances_of(here, of_here), instances_of(there, of_there),
        Identity<uint32_t>{[&](bool is_here, uint32_t i) { return name_in(scene(is_here).names().instances(), i); },
                           [&](bool is_here, uint32_t i) { return key_of(scene(is_here), i); }},
        [&](uint32_t a, uint32_t b) { instance_[a] = b; });
}

bool ShapeMatches::rename(HitBatch* hits, int i) const {
  const Place to = place_[hits->geometry[i]];
  if (to.geometry == no_id) return false;
  uint32_t instance = hits->instance[i];
  if (instance == no_id || is_single(instance))
    instance = to.instance;
  else if (instance < instance_.size())
    instance = instance_[instance];
  else
    instance = same_placements_ ? instance - uint32_t(instance_.size()) + first_placed_there_ : no_id;
  if (instance == no_id && hits->instance[i] != no_id && !is_single(hits->instance[i])) return false;
  hits->geometry[i] = to.geometry, hits->instance[i] = instance;
  return true;
}

size_t ShapeMatches::lost_shapes() const {
  return size_t(std::count_if(place_.begin(), place_.end(), [](const Place& p) { return p.geometry == no_id; }));
}

size_t ShapeMatches::lost_instances() const {
  size_t lost = same_placements_ ? 0 : placed_;
  for (size_t i = 0; i < instance_.size(); ++i) lost += !single_[i] && instance_[i] == no_id;
  return lost;
}

}  // namespace dapple::trace
