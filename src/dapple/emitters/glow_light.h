// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/transform.h"
#include "dapple/emitters/light.h"
#include "dapple/media/majorant_grid.h"

namespace dapple::emitters {

/// How much light each part of a box emits: cells, and the box in the world. All of the medium that the light is lies
/// in the box, but for what rays find by chance alone.
struct GlowCells {
  Box3f box;
  int nx = 1, ny = 1, nz = 1;
  std::vector<float> emitted;  ///< luminance of sigma_a Le, 1/m, the mean in each cell, x fastest
  RGB intensity;               ///< that leaves the medium, W/sr: the mean over directions
};

/// What a glowing medium sends, as a light. Directions are drawn towards points of the box, of a density (1/m^3) that
/// is even in each cell and follows what it emits; what arrives along a direction is whatever the medium emits there on
/// the whole way to the next surface (LightSample::glow; integrate::RayTracer::glow finds it). So there is no inverse
/// square that grows without bounds, and rays that are scattered the same way find the same light and share it by their
/// densities (Simon, Hanika and Dachsbacher 2017, "Line integration for rendering heterogeneous emissive volumes").
/// LightSample::distance is where the box ends: no way through the medium begins behind it.
class GlowLight final : public Light {
 public:
  explicit GlowLight(const GlowCells& cells);

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  /// p_light and n_light are not used.
  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;

 private:
  float pdf(const V3f& p, const V3f& wi) const;

  Box3f box_;
  RGB intensity_;
  media::MajorantGrid density_;  ///< of points that are drawn, 1/m^3
  std::vector<float> cdf_;       ///< of cells; the last is 1
};

}  // namespace dapple::emitters
