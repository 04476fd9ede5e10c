// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/measured_table.h"
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// A surface that reflects as was measured.
class MeasuredMaterial final : public SurfaceMaterial {
 public:
  MeasuredMaterial(std::shared_ptr<const scattering::MeasuredTable> table, SurfaceDetail detail);
  bool is_opaque_reflector() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  std::shared_ptr<const scattering::MeasuredTable> table_;
};

}  // namespace dapple::shading
