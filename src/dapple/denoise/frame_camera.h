// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/base/vec.h"

namespace dapple::denoise {

/// Between the pixels of a frame and the world, by OpenEXR's matrix worldToNDC (row vectors; 0 to 1 from the upper left
/// to the lower right of the display window). Pixels are those of the data window, the middle of the first at (.5, .5).
class FrameCamera {
 public:
  struct Window {
    int width = 0, height = 0;  ///< of the display window
    int x = 0, y = 0;           ///< corner of the data window, from that of the display window
  };
  /// Coordinates of a point in the world (w = 1), or a direction to what is endlessly far (w = 0).
  struct Point {
    V3d p{0, 0, 0};
    double w = 1;
  };

  /// None where the matrix is not finite or maps the world to less than pixels and depths.
  static std::optional<FrameCamera> make(const M44f& world_to_ndc, const Window& window);

  /// What a pixel shows at a depth along the camera's axis; at depths of 0, below or not finite the sky.
  Point seen_at(double x, double y, double depth) const;
  /// x, y and depth, of the sky 0. Not finite for what is behind a perspective camera, and for the sky of others.
  V3d place_of(const Point& point) const;

 private:
  FrameCamera() = default;
  M44d to_ndc_;
  Imath::M33d inverse_;  ///< of to_ndc_'s columns for x, y and depth, without translation
  V3d shift_;            ///< their translation
  int depth_column_ = 3;
  Window window_;
};

}  // namespace dapple::denoise
