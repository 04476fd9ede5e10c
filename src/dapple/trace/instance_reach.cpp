// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/instance_reach.h"

#include <algorithm>
#include <cmath>

namespace dapple::trace {

namespace {
constexpr double flattest = 1e-5;  // volume of what a cube becomes, as a share of that of a box of its sides
}

// The motion interpolates T, R and S of T R S, S upper triangular, linearly but for R: S has an inverse all the time if
// no entry of its diagonal changes sign, and what that inverse does to a vector is bounded by the smallest of these
// entries and the largest of the others.
float instance_reach(const AnimatedTransform& motion) {
  double least[3], shear[3][3], shift = 0;
  for (int i = 0; i < 3; ++i) {
    const double a = motion.decomposition(0).scale[i][i], b = motion.decomposition(1).scale[i][i];
    if (!(a * b > 0)) return 0;
    least[i] = std::min(std::abs(a), std::abs(b));
    if (!(least[i] >= least_scale * (1 - 1e-6))) return 0;
    double longest = 0;  // of the axis as it is mapped
    for (int j = 0; j <= i; ++j) {
      shear[j][i] =
          std::max(std::abs(motion.decomposition(0).scale[j][i]), std::abs(motion.decomposition(1).scale[j][i]));
      longest = std::max(longest, shear[j][i]);
    }
    if (!(longest <= most_scale * (1 + 1e-6))) return 0;
    shift +=
        std::max(std::abs(motion.decomposition(0).translation[i]), std::abs(motion.decomposition(1).translation[i]));
  }
  const double xy = shear[0][1] / (least[0] * least[1]), yz = shear[1][2] / (least[1] * least[2]);
  const double xz = shear[0][2] / (least[0] * least[2]) + xy * shear[1][2] / least[2];
  const double stretch = std::max({1 / least[0] + xy + xz, 1 / least[1] + yz, 1 / least[2]});
  const double reach = double(most_reach) / stretch - shift;
  return reach > 0 ? std::min(float(reach), most_reach) : 0;
}

// |M^-1 (p - t)| in sums of magnitudes is at most that of p - t times the largest such sum of a column of M^-1.
float placement_reach(const float m[3][4], float inside) {
  double shift = 0, stretch = 0, c[3][3];
  for (int r = 0; r < 3; ++r) {
    shift += std::abs(double(m[r][3]));
    for (int k = 0; k < 3; ++k) c[k][r] = double(m[r][k]);
  }
  const auto minor = [&c](int i, int j, int r, int s) { return c[i][r] * c[j][s] - c[i][s] * c[j][r]; };
  const double determinant = c[0][0] * minor(1, 2, 1, 2) + c[0][1] * minor(1, 2, 2, 0) + c[0][2] * minor(1, 2, 0, 1);
  double volume = 1;
  for (const auto& column : c) {
    const double size = std::sqrt(column[0] * column[0] + column[1] * column[1] + column[2] * column[2]);
    if (!(size >= least_scale * (1 - 1e-6) && size <= most_scale * (1 + 1e-6))) return 0;
    volume *= size;
  }
  if (!(std::abs(determinant) > flattest * volume) || !std::isfinite(shift)) return 0;
  for (int r = 0; r < 3; ++r) {
    const int s = (r + 1) % 3, t = (r + 2) % 3;
    const double sum = std::abs(minor(1, 2, s, t)) + std::abs(minor(2, 0, s, t)) + std::abs(minor(0, 1, s, t));
    stretch = std::max(stretch, sum / std::abs(determinant));
  }
  const double reach = double(inside) / stretch - shift;
  return reach > 0 ? std::min(float(reach), most_reach) : 0;
}

}  // namespace dapple::trace
