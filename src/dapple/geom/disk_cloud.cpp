// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/disk_cloud.h"

namespace dapple::geom {

SurfacePoint DiskCloud::at(uint32_t disk, float u, float v) const {
  const Disk& d = disks[disk];
  const V3f& n = normals[disk];
  V3f a, b;
  coordinate_system(n, &a, &b);
  const float phi = 2 * pi * u, r = d.radius * (1 - v), c = std::cos(phi), s = std::sin(phi);
  const V3f along = a * c + b * s;
  SurfacePoint p;
  p.P = d.centre + along * r;
  p.Ng = p.Ns = n;
  p.dPdu = (b * c - a * s) * (2 * pi * r);
  p.dPdv = along * -d.radius;
  if (r == 0) p.dPdu = b * c - a * s;
  p.u = u, p.v = v;
  p.error = position_error(abs(d.centre) + V3f(d.radius));
  return p;
}

V2f DiskCloud::parameters(uint32_t disk, const V3f& p) const {
  const V3f offset = p - disks[disk].centre;
  V3f a, b;
  coordinate_system(normals[disk], &a, &b);
  const float x = dot(offset, a), y = dot(offset, b);
  float turn = std::atan2(y, x) * (0.5f / pi);
  if (turn < 0) turn += 1;
  return {std::clamp(turn, 0.0f, 1.0f), std::clamp(1 - std::sqrt(x * x + y * y) / disks[disk].radius, 0.0f, 1.0f)};
}

bool DiskCloud::transform(const Transform& to_target, bool flip) {
  const M44d& m = to_target.matrix();
  double gram[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) gram[i][j] = m[0][i] * m[0][j] + m[1][i] * m[1][j] + m[2][i] * m[2][j];
  const double scale2 = (gram[0][0] + gram[1][1] + gram[2][2]) / 3;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!(std::abs(gram[i][j] - (i == j ? scale2 : 0)) <= 1e-5 * scale2)) return false;
  const float scale = float(std::sqrt(scale2)), side = flip ? -1.0f : 1.0f;
  for (Disk& d : disks) d = {to_target.point(d.centre), d.radius * scale};
  for (V3f& n : normals) n = normalize(to_target.vector(n)) * side;
  return true;
}

}  // namespace dapple::geom
