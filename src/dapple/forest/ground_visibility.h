// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/emitters/visibility.h"
#include "dapple/forest/canopy_mask.h"

namespace dapple::forest {

/// What of sun and sky arrives on the ground under trees, as the correlation of the light with the canopy tells it
/// (illumination under trees, 3; forest/penumbra.h). Maps seen from above, +x to the right and +y up, all of the same
/// rectangle, whatever their pixels; z is up.
struct GroundLight {
  struct Beam {
    V3f to_light;      ///< unit, to its centre
    float cosine = 1;  ///< of the largest angle to it that counts as the beam
    Raster share;      ///< of its irradiance on the open ground, 0 to 1; no pixels: not known
  };

  Box2f area;               ///< m
  Raster height;            ///< of the ground, m; NaN: there is none
  float tolerance = 0;      ///< m that a surface may lie above or below and be the ground
  std::vector<Beam> beams;  ///< suns
  Raster sky;               ///< share of what else comes from above; no pixels: not known
  V3f eye{0, 0, 0};
  float nearest = 0;  ///< m from the eye: ground nearer is left to others

  /// Nothing is known of any light.
  bool empty() const;
  size_t bytes() const;
};

/// Shadows on level ground far from the eye by GroundLight: the same share for every ray to one light, so that its
/// irradiance comes out without noise. It answers for surfaces within 45 degrees of level that are as high as the
/// ground; the rest it leaves to another.
class GroundVisibility final : public emitters::Visibility {
 public:
  /// rest: asked about all else; null: nobody is.
  GroundVisibility(GroundLight light, std::shared_ptr<const emitters::Visibility> rest);

  bool answers(const V3f& P, const V3f& Ng, const V3f& d) const override;
  void visible(const emitters::ShadowRays& rays, RGB* visible) const override;

 private:
  bool find(const V3f& P, const V3f& Ng, V2f* place) const;
  const Raster* share_of(const V3f& d) const;

  const GroundLight light_;
  const std::shared_ptr<const emitters::Visibility> rest_;
};

}  // namespace dapple::forest
