// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/coat_integrals.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

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

/// What a function of two numbers gave last. A scene has few coats, and every hit asks for the integrals of one.
template <class Value>
class Recent {
 public:
  template <class F>
  const Value& get(float a, float b, const F& f) {
    const uint32_t bits = std::bit_cast<uint32_t>(a) * 0x9e3779b1u ^ std::bit_cast<uint32_t>(b) * 0x85ebca6bu;
    Entry& e = entries_[bits >> (32 - size_bits)];
    if (!(e.a == a && e.b == b)) e = {a, b, f(a, b)};
    return e.value;
  }

 private:
  static constexpr int size_bits = 5;
  struct Entry {
    float a = std::numeric_limits<float>::quiet_NaN(), b = 0;  // equal to nothing
    Value value{};
  };
  std::array<Entry, 1 << size_bits> entries_;
};

float integrated_return(float ior, float thickness) {
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

CoatAlbedo integrated_albedo(float ior, float thickness) {
  const auto reflected = [&](float c) { return 2 * c * fresnel_dielectric(c, ior); };
  const auto entered = [&](float c) {
    const float mu = cos_below(c, ior);
    return mu > 0 ? 2 * c * (1 - fresnel_dielectric(c, ior)) * std::exp(-thickness / mu) : 0;
  };
  return {integrate_unit(reflected), integrate_unit(entered)};
}

}  // namespace

float coat_return(float ior, float thickness) {
  thread_local Recent<float> recent;
  return recent.get(ior, thickness, integrated_return);
}

CoatAlbedo coat_albedo(float ior, float thickness) {
  thread_local Recent<CoatAlbedo> recent;
  return recent.get(ior, thickness, integrated_albedo);
}

}  // namespace dapple::scattering
