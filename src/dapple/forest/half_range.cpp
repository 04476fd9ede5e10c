// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/half_range.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dapple::forest {

void half_range_modes(double mu, double mu_n, int modes, double* plus, double* minus, size_t stride) {
  constexpr double pi_d = std::numbers::pi;
  const double a = mu * mu_n;
  const double b = std::sqrt(std::max(0.0, (1 - mu * mu) * (1 - mu_n * mu_n)));
  if (a >= b || a <= -b) {  // one face over the whole turn
    double* seen = a >= b ? plus : minus;
    double* hidden = a >= b ? minus : plus;
    const double sign = a >= b ? 1 : -1;
    for (int m = 0; m < modes; ++m) seen[m * stride] = hidden[m * stride] = 0;
    seen[0] = sign * a;
    if (modes > 1) seen[stride] = sign * b / 2;
    return;
  }
  // n . omega = a + b cos phi is positive for |phi| < phi_t.
  const double cosine = -a / b, phi = std::acos(cosine), sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  plus[0] = (a * phi + b * sine) / pi_d;
  minus[0] = plus[0] - a;
  if (modes == 1) return;
  plus[stride] = (a * sine + b / 2 * (phi + sine * cosine)) / pi_d;
  minus[stride] = plus[stride] - b / 2;
  double s0 = sine, s1 = 2 * sine * cosine;  // sin((m - 1) phi_t), sin(m phi_t)
  for (int m = 2; m < modes; ++m) {
    const double s2 = 2 * cosine * s1 - s0;
    plus[m * stride] = minus[m * stride] = (a * s1 / m + b / 2 * (s0 / (m - 1) + s2 / (m + 1))) / pi_d;
    s0 = s1;
    s1 = s2;
  }
}

}  // namespace dapple::forest
