// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/straight_flights.h"

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/path/path_numbers.h"

namespace dapple::path {

float StraightFlights::light_probability(int p, uint32_t light, const PathWorkspace& w) const {
  const emitters::LightSampler* const sampler = w.shafted[p] ? rest() : scene_.light_sampler.get();
  return sampler ? sampler->probability(w.receiver[p], int(light)) : 0;
}

bool StraightFlights::arrive(int i, PathWorkspace& w) const {
  const light::ShaftLight& shafts = *shafts_;
  const int p = w.now->path[i];
  const Ray ray{w.now->batch.origin(i), w.now->batch.direction(i), infinity, w.time[p]};
  const float length = w.hit.geometry[i] == trace::no_id ? infinity : w.hit.t[i];
  const uint64_t key = w.vertex_key(p, 0);
  const media::MediumCrossing air =
      shafts.look_through({ray.o, ray.d, length, w.camera.seed[p], w.camera.index[p]}, ray.time, w.beta[p], key,
                          w.points_found ? nullptr : &w.shafts, [&](uint32_t light, const RGB& L) {
                            w.add_light(p, light, w.beta[p] * L, true);
                            if (w.wants_air) w.air[p].airlight += w.beta[p] * L;
                          });
  w.add_light(p, trace::no_id, w.beta[p] * air.emitted, false);
  if (!shafts.single()) {
    const media::MediumSample& s = air.scattering;
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
  w.beta[p] *= air.transmittance;
  if (w.wants_air) w.air[p].transmittance *= air.transmittance;
  return !w.beta[p].is_black() && w.beta[p].is_finite();
}

void StraightFlights::restart(PathWorkspace& w) const {
  w.point_count = w.surface_count = w.flight_count = 0;
  for (int p = 0; p < w.path_count; ++p) {
    const PathWorkspace::StraightFlight& kept = w.straight[p];
    if (!(kept.all > 0)) continue;
    w.restart_path(p);
    constexpr float always = PathNumbers::always_followed;
    if (to_unit_float(hash(w.vertex_key(p, 0), 5)) * always >= kept.all) continue;
    w.beta[p] = kept.beta * std::max(kept.all, always);
    w.medium[p] = shafts_->medium();
    const scene::CameraRay& seen = w.camera.ray[p];
    w.cone_spread[p] = seen.cone_spread * texture_footprint_;
    w.cone_width[p] = seen.cone_width * texture_footprint_ + w.cone_spread[p] * length(kept.P - seen.ray.o);
    w.flight[w.flight_count++] = {p, kept.P, kept.d};
  }
}

}  // namespace dapple::path
