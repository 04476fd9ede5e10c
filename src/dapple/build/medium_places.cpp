// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/medium_places.h"

#include <algorithm>
#include <limits>

#include "dapple/integrate/ray_origin.h"

namespace dapple::build {

namespace {

constexpr int most_surfaces = 32;  // on a ray

bool is_within(const Box3f& box, const Box3f& other) {
  return other.intersects(box.min) && other.intersects(box.max);
}

// Rays start on the surfaces, or a little beside.
Box3f widened(const Box3f& box) {
  const V3f slack = (box.max - box.min) * 1e-3f + (abs(box.min) + abs(box.max)) * 1e-6f;
  return {box.min - slack, box.max + slack};
}

Box3f transformed(const Box3f& box, const scene::Scene& scene, uint32_t instance) {
  Box3f out;
  for (int corner = 0; corner < 8; ++corner)
    out.extendBy(scene.traced.instance_point(instance,
                                             V3f((corner & 1 ? box.max : box.min).x, (corner & 2 ? box.max : box.min).y,
                                                 (corner & 4 ? box.max : box.min).z)));
  return out;
}

// Boxes that meet become one.
void join(std::vector<Box3f>* boxes) {
  if (boxes->size() > MediumPlaces::most_boxes) {
    Box3f all;
    for (const Box3f& box : *boxes) all.extendBy(box);
    boxes->assign(1, all);
    return;
  }
  for (size_t i = 0; i < boxes->size();) {
    Box3f& box = (*boxes)[i];
    const auto other = std::find_if(boxes->begin() + ptrdiff_t(i) + 1, boxes->end(),
                                    [&](const Box3f& b) { return b.intersects(box); });
    if (other == boxes->end()) {
      ++i;
      continue;
    }
    box.extendBy(*other);
    boxes->erase(other);
    i = 0;
  }
}

}  // namespace

Box3f everywhere() {
  constexpr float most = std::numeric_limits<float>::max();
  return {V3f(-most, -most, -most), V3f(most, most, most)};
}

MediumPlaces::MediumPlaces(const scene::Scene& scene) : scene_(scene), places_(scene.media.size()) {
  for (const uint32_t g : scene.traced.geometries_in(trace::no_id))
    if (scene.bindings[g].changes_medium) add(scene.bindings[g], trace::bounds_of(scene.traced.shape(g)));
  add_instances();
  for (Places& places : places_) close(&places);
  if (scene.camera_medium != scene::vacuum) {
    Places& places = places_[size_t(scene.camera_medium)];
    const V3f eye = scene.camera.position();
    places.anywhere |=
        std::none_of(places.boxes.begin(), places.boxes.end(), [&](const Box3f& box) { return box.intersects(eye); });
  }
}

void MediumPlaces::add(const scene::GeometryBinding& binding, const Box3f& box) {
  const auto valid = [](int32_t medium) { return medium != scene::vacuum; };
  if (valid(binding.inside_medium)) places_[size_t(binding.inside_medium)].boxes.push_back(widened(box));
  if (valid(binding.outside_medium) && binding.outside_medium != binding.inside_medium)
    places_[size_t(binding.outside_medium)].around.push_back(box);
}

void MediumPlaces::add_instances() {
  const auto borders_in = [&](uint32_t object) {
    std::vector<uint32_t> found;
    for (const uint32_t g : scene_.traced.geometries_in(object))
      if (scene_.bindings[g].changes_medium) found.push_back(g);
    return found;
  };
  std::vector<std::vector<uint32_t>> borders;
  for (uint32_t object = 0; object < scene_.traced.object_count(); ++object) borders.push_back(borders_in(object));
  if (std::all_of(borders.begin(), borders.end(), [](const auto& b) { return b.empty(); })) return;
  const bool too_many = scene_.traced.instance_count() > most_instances;
  for (uint32_t i = 0; !too_many && i < scene_.traced.instance_count(); ++i)
    for (const uint32_t g : borders[scene_.traced.object_of(i)]) {
      const Box3f box = trace::bounds_of(scene_.traced.shape(g));
      add(scene_.bindings[g], scene_.traced.is_animated(i) ? everywhere() : transformed(box, scene_, i));
    }
  if (too_many)
    for (const auto& of_object : borders)
      for (const uint32_t g : of_object) add(scene_.bindings[g], everywhere());
}

void MediumPlaces::close(Places* places) const {
  join(&places->boxes);
  const auto held = [&](const Box3f& hole) {
    return std::any_of(places->boxes.begin(), places->boxes.end(),
                       [&](const Box3f& box) { return is_within(hole, box); });
  };
  const auto endless = [](const Box3f& box) { return !(box.max.x < std::numeric_limits<float>::max()); };
  places->anywhere = std::any_of(places->boxes.begin(), places->boxes.end(), endless) ||
                     !std::all_of(places->around.begin(), places->around.end(), held);
}

void MediumPlaces::find(int32_t medium, const V3f* P, int n, bool* there) const {
  const V3f d = normalize(V3f(0.31f, 0.17f, 0.94f));
  trace::RayBatch rays;
  trace::HitBatch hits;
  int at[trace::RayBatch::capacity];
  for (int i = 0; i < n; ++i) {
    rays.set(i, P[i], d, infinity, 0, uint32_t(i));
    at[i] = i;
    there[i] = false;
  }
  for (int surface = 0; n > 0 && surface < most_surfaces; ++surface) {
    scene_.traced.intersect(rays, n, &hits);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      if (hits.geometry[i] == trace::no_id) continue;
      const geom::SurfacePoint p = scene_.traced.surface_without_tangents(rays, hits, i);
      const scene::GeometryBinding& binding = scene_.bindings[hits.geometry[i]];
      if (binding.changes_medium) {
        there[at[i]] = binding.medium_at(dot(d, p.Ng) > 0, medium) == medium;
        continue;
      }
      at[kept] = at[i];
      rays.set(kept++, integrate::offset_origin(p, d), d, infinity, 0, uint32_t(i));
    }
    n = kept;
  }
}

}  // namespace dapple::build
