// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/emitters/area_light.h"
#include "tests/support/chi_square.h"

namespace dapple::emitters {

/// Irradiance on the plane through `to`, by sampling the light alone.
inline test::Moments irradiance(const Light& light, const LightReceiver& to, int samples = 100000) {
  test::Moments m;
  for (int i = 0; i < samples; ++i) {
    KeyedRng rng(hash(11, i));
    LightSample s;
    if (!light.sample(to, {rng.next(), rng.next()}, &s)) {
      m.add(0);
      continue;
    }
    EXPECT_NEAR(length(s.wi), 1, 1e-4f);
    m.add(s.radiance.g * std::max(dot(to.n, s.wi), 0.0f) / s.pdf);
  }
  return m;
}

inline const LightReceiver up{.p = V3f(0, 0, 0), .n = V3f(0, 0, 1)};

inline geom::EmitterShape unit_square_at(float z) {  // facing down, 2 x 2
  const V3f corners[4] = {V3f(-1, -1, z), V3f(1, -1, z), V3f(1, 1, z), V3f(-1, 1, z)};
  return geom::EmitterShape(std::in_place_type<geom::RectangleEmitter>, corners, true);
}

}  // namespace dapple::emitters
