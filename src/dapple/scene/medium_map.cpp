// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/medium_map.h"

#include <algorithm>
#include <memory>

namespace dapple::scene {

namespace {

// Surfaces in a row; what lies behind more of them is taken to lie at infinity.
constexpr int most_surfaces = 1024;

/// Calls met(binding, outside) for each surface along a ray, until it returns true. False where it never does.
template <class Met>
bool follow(const Scene& scene, V3f o, const V3f& d, float time, const Met& met) {
  trace::RayBatch ray;
  trace::HitBatch hit;
  for (int i = 0; i < most_surfaces; ++i) {
    ray.set(0, o, d, infinity, time, 0);
    scene.traced.intersect(ray, 1, &hit);
    if (hit.geometry[0] == trace::no_id) return false;
    const geom::SurfacePoint s = scene.traced.surface_without_tangents(ray, hit, 0);
    if (met(scene.bindings[hit.geometry[0]], dot(d, s.Ng) < 0)) return true;
    o = s.P + s.Ng * (dot(d, s.Ng) < 0 ? -s.error : s.error);
  }
  return false;
}

}  // namespace

MediumMap::MediumMap(const Scene& scene) : scene_(scene), at_infinity_(scene.camera_medium) {
  walks_ = std::any_of(scene.bindings.begin(), scene.bindings.end(), [](const GeometryBinding& b) { return b.changes_medium; });
  if (!walks_) return;
  const Box3f bounds = scene.traced.bounds();
  V3f away = scene.camera.position() - (bounds.min + bounds.max) * 0.5f;
  if (!(length2(away) > 0) || !is_finite(away)) away = V3f(0, 0, 1);
  follow(scene, scene.camera.position(), normalize(away), 0, [this](const GeometryBinding& b, bool outside) {
    if (b.changes_medium) at_infinity_ = outside ? b.inside_medium : b.outside_medium;
    return false;
  });
}

int32_t MediumMap::walk(V3f o, const V3f& d, float time) const {
  int32_t medium = at_infinity_;
  follow(scene_, o, d, time, [&medium](const GeometryBinding& b, bool outside) {
    if (b.changes_medium) medium = outside ? b.outside_medium : b.inside_medium;
    return b.changes_medium;
  });
  return medium;
}

}  // namespace dapple::scene
