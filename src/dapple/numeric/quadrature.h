// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace dapple {
inline namespace numeric {

/// Nodes, ascending, and weights of a quadrature rule: the integral of f is about the sum of w[i] f(x[i]).
struct QuadratureRule {
  std::vector<double> x, w;

  template <class F>
  double integrate(F&& f) const {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * f(x[i]);
    return sum;
  }
};

/// Gauss-Legendre rule of n >= 1 nodes on [a, b], exact for polynomials up to degree 2n - 1. Nodes by Newton's method
/// on the three-term recurrence, to full precision of double; O(n^2) time. Throws std::invalid_argument for n < 1.
QuadratureRule gauss_legendre(int n, double a = -1, double b = 1);

}  // namespace numeric
}  // namespace dapple
