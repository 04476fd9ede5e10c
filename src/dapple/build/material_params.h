// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/spectrum_params.h"
#include "dapple/build/texture_factory.h"
#include "dapple/shading/coated_material.h"
#include "dapple/shading/conductor_material.h"
#include "dapple/shading/surface_material.h"

namespace dapple::build {

/// Turns the parameters of one material into the inputs of shading materials, checked. Names are pbrt-v4's; `prefix` is
/// "", "interface." or "conductor.".
class MaterialParams {
 public:
  MaterialParams(const scenefile::MaterialEntity& entity, const BuildContext& context, const TextureLibrary& textures)
      : entity_(entity), params_(entity.params), context_(context), textures_(textures) {}

  const scenefile::MaterialEntity& entity() const { return entity_; }
  const TextureLibrary& textures() const { return textures_; }

  /// Clamped to [0, 1] by the materials.
  pattern::Input<RGB> reflectance(std::string_view name, RGB fallback) const;
  pattern::Input<float> number(std::string_view name, float fallback) const;
  /// A number in [0, 1], or a texture, which the material clamps: constants elsewhere throw InputError.
  pattern::Input<float> unit_number(std::string_view name, float fallback) const;
  /// An index of refraction, between 0.01 and 100 where constant.
  pattern::Input<float> index_number(std::string_view name, float fallback) const;
  /// A colour without an upper bound; InputError where it is a negative constant.
  pattern::Input<RGB> positive_color(std::string_view name, RGB fallback) const { return index(name, fallback); }
  float constant(std::string_view name, float fallback) const { return params_.get_float(name, fallback); }
  /// Roughness, uroughness, vroughness and remaproughness; constants below zero throw, those above one are warned of.
  shading::RoughnessInput roughness(const std::string& prefix = {}) const;
  /// A dielectric's index, a number or a spectrum, of which the value at 589 nm (the sodium D line) counts. Positive; 0
  /// is 1, as in pbrt.
  float ior(std::string_view name, float fallback) const;
  /// <prefix>eta and <prefix>k, or reflectance; copper by default. Spectra are fitted for RGB
  /// (numeric/conductor_rgb.h).
  shading::MetalInput metal(const std::string& prefix, float outer_index) const;
  /// The coat of coateddiffuse (prefix "") and coatedconductor ("interface.").
  shading::CoatInput coat(const std::string& prefix) const;
  /// displacement and normalmap.
  shading::SurfaceDetail detail() const;
  /// At the material's place, and with its type.
  void warn(const std::string& message) const;
  /// Names a parameter that is not supported, and what happens instead.
  void unsupported(std::string_view name, const std::string& instead) const;
  /// A file's name, relative to the scene.
  std::string resolve(const std::string& name) const { return context_.description.resolve(name); }
  /// Of the material, for random choices: different for different ones.
  uint64_t salt() const;
  /// Marks parameters that nothing uses.
  void ignore(std::initializer_list<std::string_view> names) const;

 private:
  FileLoc location_of(std::string_view name) const;
  pattern::Input<RGB> index(std::string_view name, RGB fallback) const;
  int bounded_int(std::string_view name, int fallback, int low, int high) const;

  const scenefile::MaterialEntity& entity_;
  const scenefile::ParamSet& params_;
  const BuildContext& context_;
  const TextureLibrary& textures_;
};

}  // namespace dapple::build
