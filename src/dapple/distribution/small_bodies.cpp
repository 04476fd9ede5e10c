// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/small_bodies.h"

#include <algorithm>
#include <map>

#include "dapple/distribution/subsurface_numbers.h"
#include "dapple/scattering/diffusion_profile.h"

namespace dapple::distribution {

using scattering::Bsdf;
using scattering::BsdfKind;
using trace::no_id;

namespace {

/// m, of the channel that goes farthest; 0 if it is no body, or differs from point to point.
float free_path(const shading::Material& material) {
  if (!material.has_subsurface()) return 0;
  const std::optional<Bsdf> bsdf = material.constant();
  if (!bsdf || bsdf->kind != BsdfKind::subsurface) return 0;
  float longest = 0;
  for (int c = 0; c < 3; ++c) {
    const scattering::ReducedMedium medium(bsdf->extinction[c], bsdf->medium_albedo[c], bsdf->g);
    if (bsdf->reflectance[c] > 0 && medium.extinction > 0) longest = std::max(longest, 1 / medium.extinction);
  }
  return longest;
}

}  // namespace

std::vector<uint8_t> find_small_bodies(const scene::Scene& scene) {
  const trace::TracedScene& traced = scene.traced;
  std::vector<uint8_t> small(scene.bindings.size(), 0);
  std::vector<float> path_of(scene.materials.size());
  std::transform(scene.materials.begin(), scene.materials.end(), path_of.begin(),
                 [](const auto& material) { return free_path(*material); });
  if (std::all_of(path_of.begin(), path_of.end(), [](float path) { return path == 0; })) return small;

  std::vector<float> scale(traced.object_count(), 0);  // of the largest instance
  for (uint32_t i = 0; i < traced.single_count(); ++i) {
    float& largest = scale[traced.object_of(i)];
    largest = std::max(largest, traced.instance_scale(i));
  }
  const auto find = [&](uint32_t object, float scale_of_object) {
    std::map<uint32_t, Box3f> bodies;  // by material
    for (const uint32_t g : traced.geometries_in(object))
      if (path_of[scene.bindings[g].material] > 0)
        bodies[scene.bindings[g].material].extendBy(trace::bounds_of(traced.shape(g)));
    for (const uint32_t g : traced.geometries_in(object)) {
      const auto body = bodies.find(scene.bindings[g].material);
      if (body == bodies.end() || !(scale_of_object > 0)) continue;
      const V3f size = body->second.size() * scale_of_object;
      const float reach = std::max({size.x, size.y, size.z}) / 2;
      small[g] = reach < SubsurfaceNumbers::least_reach * path_of[body->first];
    }
  };
  find(no_id, 1);
  for (uint32_t object = 0; object < traced.object_count(); ++object) find(object, scale[object]);
  return small;
}

}  // namespace dapple::distribution
