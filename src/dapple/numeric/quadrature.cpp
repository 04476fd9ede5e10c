// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/quadrature.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dapple {
inline namespace numeric {
namespace {

struct Legendre {
  double value, derivative;
};

/// P_n and its derivative inside (-1, 1).
Legendre legendre(int n, double x) {
  double before = 1, p = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * p - (k - 1) * before) / k;
    before = p;
    p = next;
  }
  return {p, n * (before - x * p) / ((1 - x) * (1 + x))};
}

}  // namespace

QuadratureRule gauss_legendre(int n, double a, double b) {
  if (n < 1) throw std::invalid_argument("a Gauss-Legendre rule needs at least one node");
  QuadratureRule rule{std::vector<double>(static_cast<size_t>(n)), std::vector<double>(static_cast<size_t>(n))};
  const double centre = (a + b) / 2, half = (b - a) / 2;
  for (int i = 0; i < (n + 1) / 2; ++i) {
    // Tricomi's estimate of the i-th root from above.
    double x = (1 - (n - 1) / (8.0 * n * n * n)) * std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
    if (2 * i + 1 == n) x = 0;
    Legendre p = legendre(n, x);
    for (int step = 0; step < 20; ++step) {
      const double dx = p.value / p.derivative;
      x -= dx;
      p = legendre(n, x);
      if (std::abs(dx) < 1e-15) break;
    }
    const double w = 2 / ((1 - x) * (1 + x) * p.derivative * p.derivative);
    const auto lo = static_cast<size_t>(i), hi = static_cast<size_t>(n - 1 - i);
    rule.x[lo] = centre - half * x;
    rule.x[hi] = centre + half * x;
    rule.w[lo] = rule.w[hi] = half * w;
  }
  return rule;
}

}  // namespace numeric
}  // namespace dapple
