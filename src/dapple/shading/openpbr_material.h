// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/scattering/principled.h"
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// Parameters of OpenPBR 1.1, by its names and with its defaults. Colours and weights are clamped to [0, 1].
struct OpenPbrInputs {
  pattern::Input<float> base_weight{1.0f}, base_diffuse_roughness{0.0f}, base_metalness{0.0f};
  pattern::Input<RGB> base_color{RGB(0.8f)};
  pattern::Input<float> specular_weight{1.0f}, specular_roughness{0.3f}, specular_anisotropy{0.0f}, specular_ior{1.5f};
  pattern::Input<RGB> specular_color{RGB(1)};
  pattern::Input<float> transmission_weight{0.0f};
  pattern::Input<RGB> transmission_color{RGB(1)};
  pattern::Input<float> dispersion_scale{0.0f}, abbe_number{20.0f};
  pattern::Input<float> subsurface_weight{0.0f}, subsurface_anisotropy{0.0f};
  pattern::Input<RGB> subsurface_color{RGB(0.8f)};
  pattern::Input<float> coat_weight{0.0f}, coat_roughness{0.0f}, coat_anisotropy{0.0f}, coat_ior{1.6f},
      coat_darkening{1.0f};
  pattern::Input<RGB> coat_color{RGB(1)};
  pattern::Input<float> fuzz_weight{0.0f}, fuzz_roughness{0.5f};
  pattern::Input<RGB> fuzz_color{RGB(1)};
  pattern::Input<float> film_weight{0.0f}, film_thickness{0.5f}, film_ior{1.4f};  ///< thickness: micrometres
  std::optional<pattern::Input<float>> opacity;
  pattern::RgbTexturePtr coat_normal_map;  ///< or nullptr: the coat follows the surface, not its normal map
  bool thin_walled = false;  ///< transmission goes straight on, subsurface is diffuse reflection and transmission

  bool is_constant() const;
  float work() const;

 private:
  template <class Of>
  auto all(Of of) const;  ///< of() of all inputs but opacity
};

/// The layers of principled.h, point by point. Subsurface scattering counts as diffuse light of its colour: where it
/// should not, SubsurfaceMaterial takes this one's place.
class OpenPbrMaterial final : public SurfaceMaterial {
 public:
  OpenPbrMaterial(OpenPbrInputs inputs, SurfaceDetail detail);

  StageSet stages() const override;
  void opacity(const pattern::ShadingPoints& points, RGB* Oi) const override;
  bool is_diffuse() const override { return diffuse_; }
  bool is_diffuse_to_rays() const override { return !metal_ && !transmits_; }
  bool is_opaque_reflector() const override { return !transmits_; }
  bool is_translucent() const override { return translucent_; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  void finish(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;

  OpenPbrInputs in_;
  SurfaceDetail coat_detail_;
  bool tilts_coat_;
  bool diffuse_, metal_, transmits_, translucent_;  ///< of some point
};

}  // namespace dapple::shading
