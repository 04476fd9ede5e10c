// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/scattering/hair.h"
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// pbrt-v4's parameters of hair. Of what colours it, the first that is given counts, in this order.
struct HairInputs {
  std::optional<pattern::Input<RGB>> sigma_a, color;
  pattern::Input<float> eumelanin{1.3f}, pheomelanin{0.0f};
  pattern::Input<float> eta{1.55f}, beta_m{0.3f}, beta_n{0.3f}, alpha{2.0f};

  float work() const;
};

/// Fibres, on curves: HairFibre at the place across the curve that v names.
class HairMaterial final : public SurfaceMaterial {
 public:
  explicit HairMaterial(HairInputs inputs);

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  HairInputs in_;
};

}  // namespace dapple::shading
