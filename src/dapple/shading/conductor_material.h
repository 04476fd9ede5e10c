// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// The complex index of a metal: given as eta and k, or by its reflectance at normal incidence (eta = 1,
/// k = 2 sqrt(r / (1 - r)), r at most 0.9999). Either is divided by the index of the medium outside (the coat's), as
/// pbrt-v4 does.
class MetalInput {
 public:
  MetalInput(pattern::Input<RGB> eta, pattern::Input<RGB> k, float outer_index = 1)
      : first_(std::move(eta)), second_(std::move(k)), by_reflectance_(false), scale_(1 / outer_index) {}
  explicit MetalInput(pattern::Input<RGB> reflectance, float outer_index = 1)
      : first_(std::move(reflectance)), second_(RGB()), by_reflectance_(true), scale_(1 / outer_index) {}

  bool is_constant() const { return pattern::all_constant(first_, second_); }
  float work() const { return pattern::total_work(first_, second_); }

  /// A batch of indices.
  class Values {
   public:
    Values(const MetalInput& input, const pattern::ShadingPoints& points)
        : first_(input.first_, points),
          second_(input.second_, points),
          by_reflectance_(input.by_reflectance_),
          scale_(input.scale_) {}
    void get(int i, RGB* eta, RGB* k) const;

   private:
    pattern::InputValues<RGB> first_, second_;
    bool by_reflectance_;
    float scale_;
  };

 private:
  pattern::Input<RGB> first_, second_;
  bool by_reflectance_;
  float scale_;
};

/// Metal, mirror-like or rough.
class ConductorMaterial final : public SurfaceMaterial {
 public:
  ConductorMaterial(MetalInput metal, RoughnessInput roughness, SurfaceDetail detail);
  bool is_opaque_reflector() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  MetalInput metal_;
  RoughnessInput roughness_;
};

}  // namespace dapple::shading
