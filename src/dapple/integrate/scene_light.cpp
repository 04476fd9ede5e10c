// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/scene_light.h"

#include "dapple/numeric/sobol.h"

namespace dapple::integrate {

std::array<double, 3> irradiance_above(const emitters::Light& light) {
  std::array<double, 3> sum{};
  constexpr uint32_t sky_samples = 1 << 16;
  const uint32_t n = light.is_delta() ? 1 : sky_samples;
  for (uint32_t i = 0; i < n; ++i) {
    emitters::LightSample s;
    if (!light.sample({}, sample_2d(0, i, 0), &s) || !(s.wi.z > 0)) continue;
    for (int c = 0; c < 3; ++c) sum[size_t(c)] += double(s.radiance[c]) * s.wi.z / (double(s.pdf) * n);
  }
  return sum;
}

}  // namespace dapple::integrate
