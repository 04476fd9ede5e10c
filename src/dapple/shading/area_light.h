// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/geom/emitter_shape.h"
#include "dapple/image/image.h"
#include "dapple/shading/light.h"
#include "dapple/shading/texture.h"

namespace dapple::shading {

/// What a surface emits (W m^-2 sr^-1), alike in all directions on the side of its normal.
struct AreaEmission {
  RGB radiance;            ///< or the scale on `image`
  bool two_sided = false;  ///< on both sides
  /// Radiance over uv, the top row at v = 1; bilinear, clamped at the edge. May be null. Texels are finite and not negative.
  std::shared_ptr<const image::Image> image = nullptr;
  /// The surface's opacity, which rays that hit it test. May be null. A constant 0 makes a light that shines but cannot be hit.
  FloatTexturePtr alpha = nullptr;
};

/// A light that is one primitive. The shape must not be degenerate. Light::sample is the shape's, with what faces away from the receiver left out; where
/// alpha is textured, sampled radiance is multiplied by it (rays that arrive have passed that test already).
std::unique_ptr<Light> make_area_light(geom::EmitterShape shape, const AreaEmission& emission);

}  // namespace dapple::shading
