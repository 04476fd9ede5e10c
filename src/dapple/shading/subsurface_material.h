// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "dapple/numeric/half_space.h"
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// What is inside: coefficients, or the colour and scale they are to give.
struct InteriorInput {
  pattern::Input<RGB> sigma_a{RGB()}, sigma_s{RGB()};  ///< 1/m, times `scale`
  std::optional<pattern::Input<RGB>> reflectance;      ///< given: of the light that enters, the share that leaves again
  pattern::Input<RGB> mean_free_path{RGB(1)};          ///< with reflectance: 1 / (sigma_a + sigma_s), m, times `scale`
  float scale = 1;
  float g = 0;  ///< Henyey-Greenstein

  bool is_constant() const {
    return reflectance ? pattern::all_constant(*reflectance, mean_free_path) : pattern::all_constant(sigma_a, sigma_s);
  }
  float work() const {
    return reflectance ? pattern::total_work(*reflectance, mean_free_path) : pattern::total_work(sigma_a, sigma_s);
  }
};

/// Skin, marble, milk: a dielectric boundary, smooth or rough, around a body that scatters and absorbs. Textures say
/// what is below the point where light enters, or where it is seen. From coefficients to reflectance and back by
/// numeric/half_space.h.
class SubsurfaceMaterial final : public SurfaceMaterial {
 public:
  SubsurfaceMaterial(float ior, RoughnessInput roughness, InteriorInput interior, SurfaceDetail detail);
  /// Diffuse rays see its mean albedo, as of other layered materials.
  bool is_diffuse_to_rays() const override { return true; }
  bool has_subsurface() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  scattering::Bsdf from_coefficients(RGB sigma_a, RGB sigma_s, float alpha_x, float alpha_y) const;
  scattering::Bsdf from_reflectance(RGB reflectance, RGB mean_free_path, float alpha_x, float alpha_y) const;

  float ior_;
  RoughnessInput roughness_;
  InteriorInput interior_;
  HalfSpaceTable table_;
};

}  // namespace dapple::shading
