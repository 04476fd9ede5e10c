// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "dapple/shading/coat.h"

namespace dapple::shading {
namespace {

/// Gauss-Legendre rule of 16 points on [0, 1] (Abramowitz & Stegun 1964, table 25.4): int f.
template <class F>
float integrate_unit(const F& f) {
  constexpr std::array<float, 8> x = {0.0950125098f, 0.2816035508f, 0.4580167777f, 0.6178762444f,
                                      0.7554044084f, 0.8656312024f, 0.9445750231f, 0.9894009350f};
  constexpr std::array<float, 8> w = {0.1894506105f, 0.1826034150f, 0.1691565194f, 0.1495959888f,
                                      0.1246289713f, 0.0951585117f, 0.0622535239f, 0.0271524594f};
  float sum = 0;
  for (size_t i = 0; i < x.size(); ++i) sum += w[i] * (f((1 - x[i]) / 2) + f((1 + x[i]) / 2));
  return sum / 2;
}

/// Cosine below the coat of a direction with cosine c above; negative where it does not enter.
float cos_below(float c, float ior) {
  const float sin2 = (1 - c * c) / (ior * ior);
  return sin2 < 1 ? std::sqrt(1 - sin2) : -1;
}

}  // namespace

float coat_return(float ior, float thickness) {
  if (ior <= 1)
    return integrate_unit(
        [&](float mu) { return 2 * mu * fresnel_dielectric(mu, 1 / ior) * std::exp(-2 * thickness / mu); });
  // Beyond the critical angle F = 1: with x = mu^2 that part is smooth; below it, integrate over the cosine above the coat,
  // where F has no square root (mu dmu = c dc / ior^2).
  const float x_critical = 1 - 1 / (ior * ior);
  const float total = x_critical * integrate_unit([&](float x) {
                        return std::exp(-2 * thickness / std::sqrt(x * x_critical));
                      });
  const float partial = integrate_unit([&](float c) {
    return 2 * c * fresnel_dielectric(c, ior) * std::exp(-2 * thickness / cos_below(c, ior));
  });
  return total + partial / (ior * ior);
}

CoatAlbedo coat_albedo(float ior, float thickness) {
  const auto reflected = [&](float c) { return 2 * c * fresnel_dielectric(c, ior); };
  const auto entered = [&](float c) {
    const float mu = cos_below(c, ior);
    return mu > 0 ? 2 * c * (1 - fresnel_dielectric(c, ior)) * std::exp(-thickness / mu) : 0;
  };
  return {integrate_unit(reflected), integrate_unit(entered)};
}

}  // namespace dapple::shading
