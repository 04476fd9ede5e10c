// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/emitters/light.h"
#include "dapple/geom/rectangle_emitter.h"

namespace dapple::emitters {

/// A light at infinity that arrives through a rectangle only, as a sky through a window. Half of the samples are drawn
/// in proportion to the solid angle of the portal, half as the light draws them by itself, of which those beside the
/// portal bring nothing: combined by their balance (Veach & Guibas 1995). pbrt's portals, for which Bitterli, Novak and
/// Jarosz 2015 ("Portal-masked environment map sampling") give a scheme that draws from the product of both.
class PortalLight final : public Light {
 public:
  /// Corners of a rectangle, in order around it. Light comes in against (c3 - c0) x (c1 - c0): that is the side of the
  /// sky.
  PortalLight(std::unique_ptr<const Light> sky, const V3f corners[4]);

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  RGB environment_at(const V3f& p, const V3f& wi, float dwi) const override;
  bool is_infinite() const override { return true; }
  std::optional<LightBounds> bounds() const override { return std::nullopt; }
  float power(float scene_radius) const override;

 private:
  /// Where a ray from p crosses the portal towards the sky.
  bool crosses(const V3f& p, const V3f& wi, V3f* at) const;

  std::unique_ptr<const Light> sky_;
  geom::RectangleEmitter portal_;
  V3f corner_, along_u_, along_v_;  // sides over the squares of their lengths
};

}  // namespace dapple::emitters
