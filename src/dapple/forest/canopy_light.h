// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "dapple/base/transform.h"
#include "dapple/emitters/light.h"
#include "dapple/forest/canopy_mask.h"
#include "dapple/forest/sky_dome.h"
#include "dapple/forest/sun_disc.h"
#include "dapple/numeric/distribution.h"

namespace dapple::forest {

/// Sun and sky through a sheet of leaves that is not in the scene: a receiver sees along each direction the light's
/// radiance times the sheet's transmittance where that direction meets it. Receivers above the sheet see the open sky.
/// Without a mask: sun and sky themselves. A light at infinity all the same, for nothing can stand beyond it; the
/// ground's irradiance is that of forest/penumbra.h, whose model it shares.
///
/// Drawn: sun or sky with a fixed probability; the sun uniformly over its disc, the sky by radiance times a guess of
/// the receiver's cosine on cells of equal solid angle. The mask is not part of the density.
class CanopyLight final : public emitters::Light {
 public:
  struct Sheet {
    CanopyMask mask;
    float height = 1;
  };

  /// light_to_world: rigid, or with one scale for all axes; the ground of its space is z = 0, up is z, the sheet's
  /// middle stands above the origin. std::invalid_argument for others, and for heights that are not positive.
  CanopyLight(const std::optional<Sheet>& sheet, const std::optional<SunDisc>& sun, const std::optional<SkyDome>& sky,
              const Transform& light_to_world);

  bool sample(const emitters::LightReceiver& to, const V2f& u, emitters::LightSample* out) const override;
  float pdf(const emitters::LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  RGB environment_at(const V3f& p, const V3f& wi, float dwi) const override;
  bool is_infinite() const override { return true; }
  std::optional<emitters::NarrowBeam> narrow_beam() const override;
  std::optional<emitters::LightBounds> bounds() const override { return std::nullopt; }
  float power(float scene_radius) const override;

  /// It looks different from place to place.
  bool has_sheet() const { return sheet_.has_value(); }
  /// The sky alone, of a light without a sheet; null where there is no sky.
  std::unique_ptr<const CanopyLight> without_sun() const;

 private:
  V3d to_local(const V3f& wi) const;
  RGB radiance(const V3d& local) const;
  RGB transmittance(const V3f& p, const V3d& local) const;
  double sky_pdf(const V3d& local) const;

  std::optional<Sheet> sheet_;
  std::optional<SunDisc> sun_;
  std::optional<SkyDome> sky_;
  Transform world_to_light_;
  V3f x_, y_, z_;         // axes of the light's space in the world, unit
  Distribution2D cells_;  // of the sky: azimuth / 2 pi, cosine
  double sun_share_ = 0;  // probability that the sun is drawn
  float flux_ = 0;        // luminance of the irradiance on planes across the light, summed over directions
};

}  // namespace dapple::forest
