// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat_integrals.h"

#include <cmath>

#include "dapple/numeric/quadrature.h"
#include "dapple/scattering/fresnel.h"

namespace dapple::scattering {
namespace {

template <class F>
float integrate_unit(const F& f) {
  static const QuadratureRule rule = gauss_legendre(16, 0, 1);
  return static_cast<float>(rule.integrate([&](double x) { return f(static_cast<float>(x)); }));
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
  // Beyond the critical angle F = 1: mu = mu_c s^2 spreads out the fall of the exponential near zero. Below it,
  // integrate over the cosine above the coat, where F has no square root (mu dmu = c dc / ior^2).
  const float mu_c = std::sqrt(1 - 1 / (ior * ior));
  const float total = integrate_unit([&](float t) {
    const float s2 = t * t;
    return 4 * mu_c * mu_c * s2 * t * std::exp(-2 * thickness / (mu_c * s2));
  });
  const float partial = integrate_unit(
      [&](float c) { return 2 * c * fresnel_dielectric(c, ior) * std::exp(-2 * thickness / cos_below(c, ior)); });
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

}  // namespace dapple::scattering
