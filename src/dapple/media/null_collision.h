// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/media/medium.h"

namespace dapple::media {

// What happens at a collision with the majorant of an uneven medium.

enum class Collision : uint8_t { none, scattered, absorbed };

/// Adds what the medium emits there to a flight, and draws whether it scatters or goes on, each in proportion to what
/// the path's throughput `beta` would carry on (spectral tracking; Kutz et al. 2017); absorption is a weight.
/// `inverse`: 1 / majorant, not above the inverse of sigma_a + sigma_s.
inline Collision null_collision(const RGB& sigma_a, const RGB& sigma_s, const RGB& emission, float inverse,
                                const RGB& beta, KeyedRng& rng, MediumSample* flight) {
  if (!emission.is_black()) flight->emitted += flight->weight * sigma_a * emission * inverse;
  const RGB scatter = flight->weight * sigma_s * inverse;
  RGB null = RGB(1) - (sigma_a + sigma_s) * inverse;
  for (int c = 0; c < 3; ++c) null[c] = std::max(null[c], 0.0f) * flight->weight[c];
  const float on_scatter = (scatter * beta).average(), on_null = (null * beta).average();
  const float sum = on_scatter + on_null;
  if (!(sum > 0)) {
    flight->weight = RGB(0);
    return Collision::absorbed;
  }
  const float p_scatter = on_scatter / sum;
  if (rng.next() < p_scatter) {
    flight->scattered = true;
    flight->weight = scatter * (1 / p_scatter);
    return Collision::scattered;
  }
  flight->weight = null * (1 / (1 - p_scatter));
  return Collision::none;
}

/// Ratio tracking (Novak et al. 2014), with Russian roulette where hardly anything is left: false where it ends the
/// ray, whose transmittance is then 0.
inline bool pass_collision(const RGB& sigma_t, float inverse, KeyedRng& rng, RGB* transmittance) {
  RGB& out = *transmittance;
  const RGB keep = RGB(1) - sigma_t * inverse;
  for (int c = 0; c < 3; ++c) out[c] *= std::max(keep[c], 0.0f);
  if (const float most = out.max(); most < 0.05f) {
    if (rng.next() >= most * 20) return false;
    out *= 0.05f / most;
  }
  return true;
}

}  // namespace dapple::media
