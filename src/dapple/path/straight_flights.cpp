// SPDX-License-Identifier: Apache-2.0
// What media do to straight camera rays where scan planes have the light of suns and lamps: instead of a gamble whether
// the ray scatters, what it meets weakened, the planes' light, and one path that scatters for certain.
#include "dapple/base/hash.h"
#include "dapple/path/path_integrator.h"
#include "dapple/path/path_workspace.h"

namespace dapple::path {

namespace {
// Dimensions of the sampler: those of so many steps are for what camera rays meet.
constexpr uint32_t steps_of_surfaces = 1 << 14;
}  // namespace

// Path p has not scattered, and is in the medium that planes answer for.
bool PathIntegrator::is_straight(int p, const PathWorkspace& w) const {
  return settings_.shafts && w.scatterings[p] == 0 && w.medium[p] == settings_.shafts->medium();
}

// With which a light was chosen where the path's ray left.
float PathIntegrator::light_probability(int p, uint32_t light, const PathWorkspace& w) const {
  const emitters::LightSampler* const sampler = w.shafted[p] ? settings_.shafts->rest() : scene_.light_sampler.get();
  return sampler ? sampler->probability(w.receiver[p], int(light)) : 0;
}

bool PathIntegrator::arrive_straight(int i, PathWorkspace& w) const {
  const light::ShaftLight& shafts = *settings_.shafts;
  const media::ClosedFormMedium& air = shafts.air();
  const int p = w.now->path[i];
  const Ray ray{w.now->batch.origin(i), w.now->batch.direction(i), infinity, w.time[p]};
  const float length = w.hit.geometry[i] == trace::no_id ? infinity : w.hit.t[i];
  w.add_light(p, trace::no_id, w.beta[p] * air.emitted(ray, length));
  if (!w.points_found) {
    shafts.in_scattering({ray.o, ray.d, length, w.camera.seed[p], w.camera.index[p]}, &w.shafts,
                         [&](uint32_t light, const RGB& L) {
                           w.add_light(p, light, w.beta[p] * L);
                           if (w.wants_air) w.air[p].airlight += w.beta[p] * L;
                         });
  }
  if (!shafts.single()) {
    const uint64_t key = w.vertex_key(p, 0);
    const media::MediumSample s = air.sample_scattering(ray, length, w.beta[p], key);
    const RGB beta = w.beta[p] * s.weight;
    const float size = beta.max();
    PathWorkspace::StraightFlight& kept = w.straight[p];
    if (s.scattered && size > 0 && beta.is_finite()) {
      kept.all += size;
      if (to_unit_float(hash(key, 1)) * kept.all < size) {
        kept.P = ray.o + ray.d * s.t, kept.d = ray.d;
        kept.beta = beta * (1 / size);
      }
    }
  }
  const RGB through = air.transmittance(ray, length, 0);
  w.beta[p] *= through;
  if (w.wants_air) w.air[p].transmittance *= through;
  return !w.beta[p].is_black() && w.beta[p].is_finite();
}

// Paths that begin with the scatterings that arrive_straight() has kept.
void PathIntegrator::trace_straight_flights(PathWorkspace& w) const {
  w.point_count = w.surface_count = w.flight_count = 0;
  const bool wanted_features = std::exchange(w.wants_features, false);  // these are of what camera rays met
  for (int p = 0; p < w.path_count; ++p) {
    const PathWorkspace::StraightFlight& kept = w.straight[p];
    if (!(kept.all > 0)) continue;
    w.restart_path(p);
    w.beta[p] = kept.beta * kept.all;
    w.medium[p] = settings_.shafts->medium();
    const scene::CameraRay& seen = w.camera.ray[p];
    w.cone_spread[p] = seen.cone_spread * settings_.texture_footprint;
    w.cone_width[p] = seen.cone_width * settings_.texture_footprint + w.cone_spread[p] * length(kept.P - seen.ray.o);
    w.flight[w.flight_count++] = {p, kept.P, kept.d};
  }
  if (w.flight_count > 0) {
    shade_points(steps_of_surfaces, w);
    trace_paths(steps_of_surfaces + 1, w);
  }
  w.wants_features = wanted_features;
}

}  // namespace dapple::path
