// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/emitters/emission_pattern.h"
#include "dapple/emitters/light_motion.h"
#include "dapple/geom/emitter_shape.h"

namespace dapple::emitters {

/// What a surface emits (W m^-2 sr^-1), alike in all directions on the side of its normal.
struct AreaEmission {
  RGB radiance;
  bool two_sided = false;  ///< on both sides
  /// The surface lets all rays through (its alpha is 0 everywhere) and yet shines: only sampling finds it.
  bool invisible = false;
  std::shared_ptr<const EmissionPattern> pattern = nullptr;  ///< varies radiance over the surface; null = constant
};

/// A light that is one primitive. The shape must not be degenerate. Light::sample is the shape's, with what faces away
/// from the receiver left out. Where opacity varies, sampled radiance is multiplied by it (rays that arrive have passed
/// that test already).
std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission);
/// The same of a shape that moves, which is given as it is at shutter open.
std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission,
                                       std::shared_ptr<const LightMotion> motion);

}  // namespace dapple::emitters
