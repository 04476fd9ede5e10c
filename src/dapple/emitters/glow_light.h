// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/transform.h"
#include "dapple/emitters/light.h"
#include "dapple/media/majorant_grid.h"

namespace dapple::emitters {

/// How much light each part of a box emits: cells, and the box in the world.
struct GlowCells {
  Box3f box;
  int nx = 1, ny = 1, nz = 1;
  std::vector<float> emitted;  ///< luminance of sigma_a Le, 1/m, the mean in each cell, x fastest
  RGB intensity;               ///< integral of sigma_a Le over the box, W/sr: of a medium that is thin
};

/// All that glowing media send, as one light. Directions are drawn towards points of the boxes, of a density (1/m^3)
/// that is even in each cell and follows what it emits; what arrives along a direction is whatever media emit there on
/// the whole way to the next surface (LightSample::glow; integrate::RayTracer::glow finds it). So there is no inverse
/// square that grows without bounds, and rays that are scattered the same way find the same light and share it by their
/// densities (Simon, Hanika and Dachsbacher 2017, "Line integration for rendering heterogeneous emissive volumes").
class GlowLight final : public Light {
 public:
  explicit GlowLight(std::vector<GlowCells> parts);

  bool sample(const LightReceiver& to, const V2f& u, LightSample* out) const override;
  /// p_light and n_light are not used.
  float pdf(const LightReceiver& to, const V3f& wi, const V3f& p_light, const V3f& n_light) const override;
  std::optional<LightBounds> bounds() const override;
  float power(float scene_radius) const override;

 private:
  struct Part {
    Box3f box;
    media::MajorantGrid density;  ///< of points that are drawn, 1/m^3, over all parts
    std::vector<float> cdf;       ///< of cells; the last is 1
  };
  float pdf(const V3f& p, const V3f& wi) const;

  std::vector<Part> parts_;
  std::vector<float> cdf_;  ///< of parts
  Box3f box_;
  RGB intensity_;
};

}  // namespace dapple::emitters
