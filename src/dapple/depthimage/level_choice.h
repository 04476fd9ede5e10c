// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/depthimage/splat_object.h"

namespace dapple::depthimage {

/// Which images stand for an instance, by its size on the film: decide() of Max's hierarchy, made continuous. The
/// coarsest level is taken whose texels are no wider than `texel_pixels` where the object is nearest, and as its texels
/// shrink, more and more of the sub-samples of each pixel take the next coarser one, so that nothing pops. Nearer than
/// the finest level allows, more and more of the pixels see the object itself, by rays.
struct LevelChoice {
  static constexpr int ray_steps = 8;
  static constexpr uint16_t all_samples = 0xffff;

  struct Use {
    int level = 0;
    uint16_t samples = all_samples;  ///< sub-samples of a pixel, as SampleMask
  };
  bool visible = false;
  int ray_share = 0;  ///< of ray_steps pixels
  int count = 0;
  std::array<Use, 2> use;
  Box2f film;  ///< pixels in which it lies, at most

  /// seed: of the order in which sub-samples change. resolution: of the film.
  LevelChoice() = default;
  LevelChoice(const SplatObject& object, const Placement& world, const ScreenMap& camera, const V2i& resolution,
              float texel_pixels, uint64_t seed);
};

/// Which of `ray_steps` groups a pixel belongs to: eight neighbours of a row are of eight groups.
inline int ray_group(const V2i& pixel, uint32_t round) {
  return int((unsigned(pixel.x) + 3u * unsigned(pixel.y) + round) % unsigned(LevelChoice::ray_steps));
}

}  // namespace dapple::depthimage
