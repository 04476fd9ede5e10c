// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace dapple::distribution {

/// Fitted numbers of shading grids: where visible points lie, and which share their work (docs/design/003, 016).
struct GridNumbers {
  /// Instructions a point (shading::Material::work), up to which prelighting is cheap beside the rays of a point: then
  /// it may run for each camera sample, and where few rays would read what is cached of it.
  static constexpr float cheap_work = 3000;
  /// Times a shading point may be shorter than its pixel asks for, at contact lines: a power of two.
  static constexpr float most_refined = 4;
  /// A point is n times as fine as its pixel asks for if n of its lengths are less than this much of what that is:
  /// rates are powers of two, so that points are .7 to 1.4 times as long.
  static constexpr float finer_than = 1.2f;
  /// Points of diced surfaces, which are displaced or curved, stand closer by this: points that bumps hide share in
  /// what is seen between them.
  static constexpr float diced_spacing = 0.8f;
  /// Samples of a pixel whose small patches may be chosen.
  static constexpr uint32_t first_samples = 16;
  /// Rays, light or diffuse, that each point of small patches sends of its own.
  static constexpr int least_rays = 4;
  /// Such points that share the diffuse rays of one hemisphere, where hemispheres serve the others.
  static constexpr int points_of_hemisphere = 16;
  /// Radians, spread of rays by diffuse lobes at least: path::PathNumbers::diffuse_spread.
  static constexpr float diffuse_spread = 0.05f;
  /// Radians: wider than this, the textures that rays read would blur what shadows and edges do not.
  static constexpr float widest_spread = 0.25f;
};

}  // namespace dapple::distribution
