// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::gi {

/// Fitted numbers of TileLinks: which ways between points of a tile are tried. In cells, or lengths of ways within
/// groups.
struct LinkNumbers {
  /// Obstacles nearer than this to the edge of a tile or cell are ignored, such as a room's walls at the edge of its
  /// floor. Rays of cells keep as far from their edges, too.
  static constexpr float margin = 0.04f;
  /// Above the surface: so far rays keep that look for obstacles.
  static constexpr float height = 0.03f;
  /// Where, beside that, something small must stand in a way to part it.
  struct Offset {
    float height, aside;
  };
  static constexpr Offset other_ways[] = {{0.1f, 0.1f}, {0.2f, -0.1f}, {0.25f, 0}};
  /// A group lies in a surface where three quarters of its parts have a normal like that of its stand-in (cosine), and
  /// are near its plane (sine of the angle).
  static constexpr float like_normals = 0.7f, near_plane = 0.3f;
};

}  // namespace dapple::gi
