// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/conductor_material.h"
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// The coat of CoatedDiffuseMaterial and CoatedConductorMaterial. Thickness is at least 0, g within +-0.99, albedo in
/// [0, 1].
struct CoatInput {
  float ior = 1.5f;
  RoughnessInput roughness;
  pattern::Input<float> thickness{0.01f}, g{0.0f};
  pattern::Input<RGB> albedo{RGB()};
  int max_depth = 10, sample_count = 1;

  bool is_constant() const { return pattern::all_constant(roughness.u, roughness.v, thickness, g, albedo); }
  float work() const { return pattern::total_work(roughness.u, roughness.v, thickness, g, albedo); }
  /// Of a rough isotropic coat of index above 1 whose numbers are constant and whose layer does not scatter; else null.
  std::shared_ptr<const scattering::RoughCoatTable> table() const;
};

/// Paint under varnish, plastic: a diffuse base under a dielectric coat.
class CoatedDiffuseMaterial final : public SurfaceMaterial {
 public:
  CoatedDiffuseMaterial(pattern::Input<RGB> reflectance, CoatInput coat, SurfaceDetail detail);
  bool is_diffuse_to_rays() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  pattern::Input<RGB> reflectance_;
  CoatInput coat_;
  std::optional<float> coat_return_;                              ///< where the thickness is constant
  std::shared_ptr<const scattering::RoughCoatTable> rough_coat_;  ///< where the coat is, and isotropic; else null
};

/// Lacquered metal. The metal's index is relative to the coat (MetalInput's outer_index).
class CoatedConductorMaterial final : public SurfaceMaterial {
 public:
  CoatedConductorMaterial(MetalInput metal, RoughnessInput roughness, CoatInput coat, SurfaceDetail detail);
  bool is_opaque_reflector() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  MetalInput metal_;
  RoughnessInput roughness_;
  CoatInput coat_;
};

}  // namespace dapple::shading
