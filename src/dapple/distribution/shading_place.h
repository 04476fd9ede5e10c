// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/distribution/cache_numbers.h"
#include "dapple/integrate/point_batch.h"

namespace dapple::distribution {

/// How a ray came to the points of a batch.
enum class Arrival {
  view,     ///< from the camera, through mirrors and glass
  diffuse,  ///< from a diffuse surface or a medium. Layered materials, and metal if caustics are off, count as diffuse
            ///< ones of their mean albedo; emitters are dark, since shadow rays have found them; no stage sees a viewer
  coat,     ///< the same, for what coats mirror there where that is not counted as diffuse
  onward,  ///< from the same, and one ray goes on from here: layered materials keep their layers, of which it takes one
  probe    ///< it asks how much light enters a subsurface body there: `diffuse` is that / pi
};

/// Where a batch stands in the recursion.
struct Place {
  int level = 0;
  integrate::Depth depth;
  Arrival arrival = Arrival::view;

  /// Rays from here go on by Russian roulette: so far behind a diffuse surface that few see what they bring.
  bool ends_by_chance() const {
    return depth.diffuse > 0 && depth.diffuse + depth.specular + 1 >= CacheNumbers::roulette_depth;
  }
  Place behind_diffuse() const { return {level + 1, {depth.diffuse + 1, depth.specular}, Arrival::diffuse}; }
  /// Where lists of rays are read: what enters a subsurface body, or is seen in fog, serves many points, as what
  /// diffuse rays meet does.
  int list_depth() const { return arrival == Arrival::view ? 0 : std::max(depth.diffuse, 1); }
};

/// What random numbers of a point are for; 1 is DirectLight's.
enum class Purpose : uint32_t {
  diffuse_rays = 2,
  specular_rays,
  walks,
  origins,
  patterns,
  origin_times,
  coats,
  roulette,
  survey,
  openness,
  wavelengths,
  probes = 16,
  phase = 0x706873,
  flights = 0x666c79
};
template <class... More>
uint64_t random_of(uint64_t key, Purpose purpose, const More&... more) {
  return hash(key, uint32_t(purpose), more...);
}
inline uint32_t seed_of(uint64_t key, Purpose purpose) {
  return uint32_t(random_of(key, purpose, 0));
}

}  // namespace dapple::distribution
