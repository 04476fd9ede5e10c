// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/conductor_rgb.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "dapple/numeric/fresnel.h"

namespace dapple {
inline namespace numeric {
namespace {

constexpr double brightest = 0.9999;

struct Angle {
  double cos_theta, reflectance;
};

double k_for(double eta, double r0) {
  return std::sqrt(std::max(0.0, (r0 * (eta + 1) * (eta + 1) - (eta - 1) * (eta - 1)) / (1 - r0)));
}

double squared_error(double eta, double r0, const std::vector<Angle>& angles) {
  const double k = k_for(eta, r0);
  double sum = 0;
  for (const Angle& a : angles) {
    const double d = fresnel_conductor(a.cos_theta, eta, k) - a.reflectance;
    sum += d * d;
  }
  return sum;
}

/// The eta in the range where k is real that fits best: a scan in log(eta), then a golden-section search around the
/// best.
double best_eta(double r0, const std::vector<Angle>& angles) {
  const double root = std::sqrt(r0);
  const double end = std::log((1 + root) / (1 - root));
  const double lo = std::max(-end, std::log(0.01)), hi = std::min(end, std::log(10.0));  // no metal lies beyond
  constexpr int steps = 200;
  const auto error = [&](double log_eta) { return squared_error(std::exp(log_eta), r0, angles); };
  int best = 0;
  double least = error(lo);
  for (int i = 1; i <= steps; ++i) {
    const double e = error(lo + (hi - lo) * i / steps);
    if (e < least) {
      least = e;
      best = i;
    }
  }
  constexpr double golden = 0.6180339887498949;
  double a = lo + (hi - lo) * std::max(best - 1, 0) / steps, b = lo + (hi - lo) * std::min(best + 1, steps) / steps;
  for (int i = 0; i < 60; ++i) {
    const double c = b - golden * (b - a), d = a + golden * (b - a);
    if (error(c) < error(d))
      b = d;
    else
      a = c;
  }
  return std::exp((a + b) / 2);
}

}  // namespace

RGB conductor_reflectance(const SampledSpectrum& eta, const SampledSpectrum& k, double cos_theta, float outer_index) {
  std::vector<float> wavelengths, values;
  for (int nm = visible_min; nm <= visible_max; nm += 2) {
    wavelengths.push_back(static_cast<float>(nm));
    values.push_back(static_cast<float>(fresnel_conductor(cos_theta, eta(nm) / outer_index, k(nm) / outer_index)));
  }
  return reflectance_to_rgb({std::move(wavelengths), std::move(values)});
}

ConductorRgb conductor_to_rgb(const SampledSpectrum& eta, const SampledSpectrum& k, float outer_index) {
  std::vector<double> cosines;
  std::vector<RGB> colours;
  for (double degrees = 0; degrees <= 85; degrees += 2.5) {
    cosines.push_back(std::cos(degrees * std::numbers::pi / 180));
    colours.push_back(conductor_reflectance(eta, k, cosines.back(), outer_index));
  }
  ConductorRgb out;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<Angle> angles;
    for (size_t i = 0; i < cosines.size(); ++i)
      angles.push_back({cosines[i], std::clamp<double>(colours[i][channel], 0, brightest)});
    const double r0 = angles.front().reflectance, best = best_eta(r0, angles);
    out.eta[channel] = static_cast<float>(best);
    out.k[channel] = static_cast<float>(k_for(best, r0));
  }
  return out;
}

ConductorRgb conductor_from_reflectance(RGB reflectance) {
  return {RGB(1),
          {conductor_k_from_reflectance(reflectance.r), conductor_k_from_reflectance(reflectance.g),
           conductor_k_from_reflectance(reflectance.b)}};
}

}  // namespace numeric
}  // namespace dapple
