// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/fresnel.h"

namespace dapple {
inline namespace numeric {
namespace {

/// From the thinner side, n > 1.
double external(double n) {
  const double n2 = n * n, n4 = n2 * n2, plus = n2 + 1, minus = n2 - 1, n4_minus = n4 - 1;
  return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
         n2 * minus * minus / (plus * plus * plus) * std::log((n - 1) / (n + 1)) -
         2 * n2 * n * (n2 + 2 * n - 1) / (plus * n4_minus) +
         8 * n4 * (n4 + 1) / (plus * n4_minus * n4_minus) * std::log(n);
}

}  // namespace

double fresnel_diffuse(double eta) {
  if (!(eta > 0)) return 1;
  const double n = eta >= 1 ? eta : 1 / eta;
  constexpr double near_one = 1.0001;
  const double from_outside = n > near_one ? external(n) : external(near_one) * ((n - 1) / (near_one - 1));
  // Reciprocity: what crosses from inside is 1/n^2 of what crosses from outside.
  return eta >= 1 ? from_outside : 1 - (1 - from_outside) / (n * n);
}

}  // namespace numeric
}  // namespace dapple
