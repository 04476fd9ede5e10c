// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/frame_camera.h"

#include <cmath>
#include <limits>

namespace dapple::denoise {

std::optional<FrameCamera> FrameCamera::make(const M44f& world_to_ndc, const Window& window) {
  FrameCamera c;
  c.to_ndc_ = M44d(world_to_ndc);
  c.window_ = window;
  const M44d& m = c.to_ndc_;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (!std::isfinite(m[i][j])) return std::nullopt;
  const bool perspective = m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0;
  if (!perspective && m[3][3] != 1) return std::nullopt;
  c.depth_column_ = perspective ? 3 : 2;
  const int columns[3] = {0, 1, c.depth_column_};
  Imath::M33d a;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = m[i][columns[j]];
  c.shift_ = V3d(m[3][0], m[3][1], m[3][c.depth_column_]);
  const double size = std::abs(a.determinant());
  if (!(size > 0) || window.width < 1 || window.height < 1) return std::nullopt;
  c.inverse_ = a.inverse();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!std::isfinite(c.inverse_[i][j])) return std::nullopt;
  return c;
}

FrameCamera::Point FrameCamera::seen_at(double x, double y, double depth) const {
  const double u = (x + window_.x) / window_.width, v = (y + window_.y) / window_.height;
  const bool perspective = depth_column_ == 3;
  if (!(depth > 0) || !std::isfinite(depth)) return {(perspective ? V3d(u, v, 1) : V3d(0, 0, 1)) * inverse_, 0};
  const double w = perspective ? depth : 1;
  return {(V3d(u * w, v * w, depth) - shift_) * inverse_, 1};
}

V3d FrameCamera::place_of(const Point& point) const {
  const auto column = [&](int j) {
    return point.p.x * to_ndc_[0][j] + point.p.y * to_ndc_[1][j] + point.p.z * to_ndc_[2][j] + point.w * to_ndc_[3][j];
  };
  const double w = column(3);
  if (!(w > 0)) return V3d(std::numeric_limits<double>::infinity());
  return {column(0) / w * window_.width - window_.x, column(1) / w * window_.height - window_.y,
          point.w * column(depth_column_)};
}

}  // namespace dapple::denoise
