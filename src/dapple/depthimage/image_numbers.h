// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::depthimage {

/// Fitted numbers of layered images (docs/design/033).
struct ImageNumbers {
  /// Pieces of surfaces in a texel are one fragment if the cosine between their normals is above the first, the way
  /// from one to the other leaves the plane at an angle whose sine is at most the second, and their heights differ by
  /// no more than so many texels. Leaves that lie behind each other must not be one: points between them are in more
  /// shade than leaves that are seen.
  static constexpr float merge_cosine = 0.95f, merge_sine = 0.2f, merge_depth = 2;
  /// Of a texel, by which it is drawn beyond its border, so that no crack shows between neighbours on bent surfaces.
  static constexpr float overlap = 0.03f;
  /// Pixels that a texel may be wide: coarser images are not taken. Samples of a mask are then half a pixel apart.
  static constexpr float texel_pixels = 2;
  /// Where between two levels, by the logarithm of their sizes, the change begins.
  static constexpr float dissolve_begin = 0.75f;
};

}  // namespace dapple::depthimage
