// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/input.h"
#include "dapple/shading/material.h"

namespace dapple::shading {

/// A share `amount` (clamped to [0, 1]; NaN is 0) of the second material. Where both are diffuse, or stand for diffuse
/// ones, and their frames agree, reflectances are blended; else one of the two at each point, at random: a hash of the
/// point's key and of `salt`, which must differ between mixes that nest.
class MixMaterial final : public Material {
 public:
  MixMaterial(MaterialPtr first, MaterialPtr second, pattern::Input<float> amount, uint64_t salt);

  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  void flat_prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  bool needs_differentials() const override;
  float work() const override { return first_->work() + second_->work() + pattern::total_work(amount_); }
  bool is_diffuse_to_rays() const override { return first_->is_diffuse_to_rays() && second_->is_diffuse_to_rays(); }
  bool is_opaque_reflector() const override { return first_->is_opaque_reflector() && second_->is_opaque_reflector(); }
  bool is_diffuse() const override { return first_->is_diffuse() && second_->is_diffuse(); }
  bool is_translucent() const override { return first_->is_translucent() || second_->is_translucent(); }
  bool is_random() const override { return !is_diffuse(); }
  bool is_interface() const override { return first_->is_interface() && second_->is_interface(); }
  bool has_subsurface() const override { return first_->has_subsurface() || second_->has_subsurface(); }
  const Material& first() const { return *first_; }
  const Material& second() const { return *second_; }

 private:
  void blend(const pattern::ShadingPoints& points, scattering::Bsdf* first, const scattering::Bsdf* second) const;

  MaterialPtr first_, second_;
  pattern::Input<float> amount_;
  uint64_t salt_;
};

/// A surface that is not there: it only separates media.
class InterfaceMaterial final : public Material {
 public:
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  bool needs_differentials() const override { return false; }
  float work() const override { return 0; }
  std::optional<scattering::Bsdf> constant() const override { return scattering::Bsdf::make_passthrough(); }
  bool is_interface() const override { return true; }
};

}  // namespace dapple::shading
