// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/field_lobes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dapple/forest/half_range.h"

namespace dapple::forest {

namespace {

constexpr double pi_d = std::numbers::pi;

std::vector<double> lobe_sum(const CanopyOperators& ops, const Field& field, const std::vector<double>& up,
                             const std::vector<double>& down, double phi) {
  const int count = ops.canopy().wavelengths, n = ops.options().nodes.size();
  std::vector<double> out(size_t(ops.levels()) * count, 0);
  for (int l = 0; l < ops.levels(); ++l)
    for (int w = 0; w < count; ++w)
      for (int m = 0; m < ops.options().modes; ++m) {
        double sum = 0;
        for (int i = 0; i < n; ++i)
          sum += ops.options().nodes.w[i] *
                 (field.up(l, w, m, i) * up[m * n + i] + field.down(l, w, m, i) * down[m * n + i]);
        out[size_t(l) * count + w] += 2 * pi_d * sum * (field.sine() ? std::sin(m * phi) : std::cos(m * phi));
      }
  return out;
}

}  // namespace

std::vector<double> irradiance_on(const CanopyOperators& ops, const Field& field, double mu_n, double phi, From from) {
  const int n = ops.options().nodes.size();
  std::vector<double> up(size_t(ops.options().modes) * n), down(up.size()), other(up.size());
  for (int i = 0; i < n; ++i) {
    half_range_modes(ops.options().nodes.mu[i], mu_n, ops.options().modes, &other[i], &up[i], n);
    half_range_modes(-ops.options().nodes.mu[i], mu_n, ops.options().modes, &other[i], &down[i], n);
  }
  if (from == From::above) std::fill(up.begin(), up.end(), 0);
  if (from == From::below) std::fill(down.begin(), down.end(), 0);
  return lobe_sum(ops, field, up, down, phi);
}

std::vector<double> light_in_lobe(const CanopyOperators& ops, const Field& field, double mu_r, double phi,
                                  double exponent) {
  const int n = ops.options().nodes.size(), points = std::max(128, 4 * ops.options().modes);
  std::vector<double> up(size_t(ops.options().modes) * n, 0), down(up.size(), 0);
  for (int i = 0; i < n; ++i)
    for (int sign : {1, -1}) {
      const double mu = sign * ops.options().nodes.mu[i], s = std::sqrt((1 - mu * mu) * std::max(0.0, 1 - mu_r * mu_r));
      for (int k = 0; k < points; ++k) {
        const double angle = pi_d * (k + 0.5) / points, x = mu * mu_r + s * std::cos(angle);
        if (x <= 0) continue;
        const double value = (exponent + 1) / (2 * pi_d) * std::pow(x, exponent) / points;
        for (int m = 0; m < ops.options().modes; ++m) (sign > 0 ? up : down)[m * n + i] += value * std::cos(m * angle);
      }
    }
  return lobe_sum(ops, field, up, down, phi);
}

}  // namespace dapple::forest
