// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/bent_normal.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dapple::scattering {

namespace {

/// S, for the cosines of wi with either normal and that between these.
float shadowing(float geometric, float shading, float between) {
  const float ratio = std::min(1.0f, geometric / std::max(shading * between, 1e-9f));
  return ratio * (2 - ratio);
}

}  // namespace

float terminator(const V3f& wi, const V3f& shading, const V3f& geometric) {
  const float above = dot(wi, geometric), seen = dot(wi, shading);
  if (!(above * seen > 0)) return 0;
  return shadowing(std::abs(above), std::abs(seen), std::abs(dot(shading, geometric)));
}

float mean_terminator(const V3f& shading, const V3f& geometric) {
  constexpr int steps = 32;  // of the angle between the normals, to 90 degrees
  static const std::array<float, steps + 1> means = [] {
    std::array<float, steps + 1> out;
    constexpr int across = 32, around = 128;
    for (int i = 0; i <= steps; ++i) {
      const float t = float(i) * (pi / 2) / steps, between = std::cos(t);
      double sum = 0;
      int above = 0;
      for (int a = 0; a < across; ++a)
        for (int b = 0; b < around; ++b) {  // equal shares of cosine-weighted solid angle about the shading normal
          const float r = std::sqrt((float(a) + 0.5f) / across), z = std::sqrt(1 - r * r);
          const float above_surface = std::sin(t) * r * std::cos((float(b) + 0.5f) * (2 * pi / around)) + between * z;
          if (!(above_surface > 0)) continue;
          sum += double(shadowing(above_surface, z, between));
          ++above;
        }
      out[size_t(i)] = float(sum / above);
    }
    return out;
  }();
  const float x = std::acos(std::clamp(dot(shading, geometric), 0.0f, 1.0f)) * (steps / (pi / 2));
  const int i = std::min(int(x), steps - 1);
  return lerp(x - float(i), means[size_t(i)], means[size_t(i) + 1]);
}

Frame frame_seen_from(const V3f& wo, const Frame& shading, const V3f& normal) {
  const float geometric = dot(normal, wo), sign = geometric < 0 ? -1.0f : 1.0f;
  const float cosine = sign * dot(shading.n, wo), least = std::min(0.5f * std::abs(geometric), 0.1f);
  if (cosine >= least) return shading;
  const V3f along = shading.n - wo * (sign * cosine);
  const float l2 = length2(along);
  if (!(l2 > 1e-12f)) return shading;
  return Frame(normalize(along * (std::sqrt(1 - sqr(least)) / std::sqrt(l2)) + wo * (sign * least)), shading.s);
}

}  // namespace dapple::scattering
