// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::denoise {

/// When a pixel of another frame shows the same as one of this frame, so that they may be averaged.
struct SequenceNumbers {
  static constexpr int neighbours = 1;  ///< frames before, and after

  // Of each of the four pixels around the place.
  static constexpr float depth_slopes = 1.5f;  ///< by how many times its change from pixel to pixel depths may differ
  static constexpr float depth_share = .003f;  ///< and by this share of them
  static constexpr float normal_distance = .35f;  ///< between ends of normals
  static constexpr float albedo_distance = .15f;  ///< in any channel
  static constexpr float least_weight = .25f;     ///< of those of the four that pass, by bilinear weights

  static constexpr float least_albedo = .03f;  ///< added to albedo where light is divided by it

  // Of colours, as display values x / (x + .18) after exposure: means over squares of pixels may differ by noise.
  static constexpr int radii[3] = {1, 3, 8};                ///< of the squares
  static constexpr float unseen[3] = {.016f, .01f, .006f};  ///< difference that counts as none
  static constexpr float sure = 2, never = 3.5f;  ///< standard errors up to which all counts, and from which nothing
  static constexpr float correlation = 2;         ///< by which bilinear look-ups make fewer of the pixels of a square
};

}  // namespace dapple::denoise
