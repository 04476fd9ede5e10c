// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/rgb_primaries.h"

namespace dapple {
inline namespace numeric {
namespace {

RgbMatrix operator*(const RgbMatrix& a, const RgbMatrix& b) {
  RgbMatrix out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return out;
}

RgbMatrix inverse(const RgbMatrix& a) {
  RgbMatrix out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int r = (j + 1) % 3, s = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      out.m[i][j] = a.m[r][c] * a.m[s][d] - a.m[r][d] * a.m[s][c];
    }
  const double det = a.m[0][0] * out.m[0][0] + a.m[0][1] * out.m[1][0] + a.m[0][2] * out.m[2][0];
  for (auto& row : out.m)
    for (double& v : row) v /= det;
  return out;
}

using Triple = std::array<double, 3>;

Triple apply(const RgbMatrix& a, const Triple& v) {
  Triple out;
  for (size_t i = 0; i < 3; ++i) out[i] = a.m[i][0] * v[0] + a.m[i][1] * v[1] + a.m[i][2] * v[2];
  return out;
}

/// A chromaticity at X + Y + Z = 1, and at Y = 1.
Triple xyz(const std::array<double, 2>& xy) {
  return {xy[0], xy[1], 1 - xy[0] - xy[1]};
}
Triple white_xyz(const std::array<double, 2>& xy) {
  return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]};
}

RgbMatrix bradford(const std::array<double, 2>& from, const std::array<double, 2>& to) {
  const RgbMatrix cones = {{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
  const Triple a = apply(cones, white_xyz(from)), b = apply(cones, white_xyz(to));
  const RgbMatrix gain = {{{b[0] / a[0], 0, 0}, {0, b[1] / a[1], 0}, {0, 0, b[2] / a[2]}}};
  return inverse(cones) * gain * cones;
}

}  // namespace

RGB RgbMatrix::operator()(RGB c) const {
  const Triple v = apply(*this, {c.r, c.g, c.b});
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

RgbMatrix rgb_to_xyz(const RgbPrimaries& from) {
  RgbMatrix primaries;
  const Triple columns[3] = {xyz(from.red), xyz(from.green), xyz(from.blue)};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) primaries.m[i][j] = columns[j][i];
  const Triple amounts = apply(inverse(primaries), white_xyz(from.white));
  for (auto& row : primaries.m)
    for (size_t j = 0; j < 3; ++j) row[j] *= amounts[j];
  return primaries;
}

RgbMatrix white_balance(const std::array<double, 2>& from) {
  const RgbMatrix to_xyz = rgb_to_xyz(rec709_primaries);
  return inverse(to_xyz) * bradford(from, rec709_primaries.white) * to_xyz;
}

RgbMatrix rgb_to_rec709(const RgbPrimaries& from, White white) {
  const RgbMatrix to_rgb = inverse(rgb_to_xyz(rec709_primaries));
  if (white == White::keep) return to_rgb * rgb_to_xyz(from);
  return to_rgb * bradford(from.white, rec709_primaries.white) * rgb_to_xyz(from);
}

}  // namespace numeric
}  // namespace dapple
