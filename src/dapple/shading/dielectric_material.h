// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// Glass, water: the boundary of a body of index ior, smooth or rough. The index is the same for all wavelengths.
class DielectricMaterial final : public SurfaceMaterial {
 public:
  DielectricMaterial(float ior, RoughnessInput roughness, SurfaceDetail detail);
  float ior() const { return ior_; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  float ior_;
  RoughnessInput roughness_;
};

/// A thin pane: light goes straight through; the interreflections inside are summed.
class ThinDielectricMaterial final : public SurfaceMaterial {
 public:
  ThinDielectricMaterial(float ior, SurfaceDetail detail);

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  float ior_;
};

}  // namespace dapple::shading
