// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/medium_borders.h"

#include <algorithm>

#include "dapple/integrate/changes_medium.h"
#include "dapple/trace/object_paths.h"

namespace dapple::integrate {

using trace::no_id;

namespace {

/// The geometries of an object, or of the scene (no_id), that are such surfaces.
std::vector<uint32_t> borders_in(const scene::Scene& scene, const MaterialTable& materials, uint32_t object) {
  std::vector<uint32_t> found;
  for (const uint32_t g : scene.traced.geometries_in(object))
    if (changes_medium(scene, materials, g)) found.push_back(g);
  return found;
}

/// Calls visit(instance) for where objects stand that hold any, until it says no.
template <class Visit>
void for_each_place(const scene::Scene& scene, const std::vector<bool>& holds, const Visit& visit) {
  for (uint32_t i = 0; i < scene.traced.single_count(); ++i)
    if (holds[scene.traced.object_of(i)] && !visit(i)) return;
  const trace::ObjectPaths paths(scene.traced);
  for (const uint32_t object : paths.objects()) {
    if (!holds[object]) continue;
    for (uint64_t i = 0; i < paths.count(object); ++i)
      if (!visit(paths.instance(object, i))) return;
  }
}

std::vector<bool> objects_with_borders(const scene::Scene& scene, const MaterialTable& materials) {
  std::vector<bool> holds(scene.traced.object_count());
  for (uint32_t object = 0; object < holds.size(); ++object)
    holds[object] = !borders_in(scene, materials, object).empty();
  return holds;
}

}  // namespace

std::string MediumBorders::obstacle(const scene::Scene& scene, const MaterialTable& materials) {
  if (!scene.has_media()) return {};
  for (uint32_t g = 0; g < scene.bindings.size(); ++g) {
    const scene::GeometryBinding& binding = scene.bindings[g];
    if (changes_medium(scene, materials, g) && (binding.alpha || binding.opacity))
      return "surfaces between media are cut out";
  }
  uint64_t places = 0;
  bool moves = false;
  for_each_place(scene, objects_with_borders(scene, materials), [&](uint32_t i) {
    moves |= scene.traced.is_animated(i);
    return !moves && ++places <= most_places;
  });
  if (moves) return "objects with surfaces between media move";
  return places > most_places ? "too many objects hold surfaces between media" : std::string();
}

std::shared_ptr<const MediumBorders> MediumBorders::find(const scene::Scene& scene, const MaterialTable& materials) {
  if (!scene.has_media()) return nullptr;
  const auto out = std::make_shared<MediumBorders>();
  const auto add = [&](uint32_t of, uint32_t to) {
    for (const uint32_t g : borders_in(scene, materials, of)) {
      out->traced_.add(scene.traced.shape(g), trace::CutOut::none, to);
      out->geometries_.push_back(g);
    }
  };
  add(no_id, no_id);
  const std::vector<bool> holds = objects_with_borders(scene, materials);
  std::vector<uint32_t> objects(holds.size(), no_id);
  for (uint32_t object = 0; object < holds.size(); ++object)
    if (holds[object]) add(object, objects[object] = out->traced_.add_object());
  for_each_place(scene, holds, [&](uint32_t i) {
    float rows[3][4];
    scene.traced.instance_rows(i, 0, rows);
    M44d matrix;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) matrix[r][c] = double(rows[r][c]);
    const Transform placed(matrix);
    out->traced_.add_instance(objects[scene.traced.object_of(i)], AnimatedTransform(placed, placed));
    return true;
  });
  if (out->geometries_.empty()) return nullptr;
  if (scene.traced.period()) out->traced_.set_period(*scene.traced.period());
  out->traced_.commit();
  return out;
}

}  // namespace dapple::integrate
