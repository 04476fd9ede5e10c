// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/measured_material.h"

namespace dapple::shading {

MeasuredMaterial::MeasuredMaterial(std::shared_ptr<const scattering::MeasuredTable> table, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), table_(std::move(table)) {
  settle(true, 0);
}

void MeasuredMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  scattering::Bsdf b;
  b.kind = scattering::BsdfKind::measured;
  b.table = table_.get();
  b.alpha_x = 1;  // unequal: the frame follows the surface's u
  std::fill_n(out, points.count, b);
}

}  // namespace dapple::shading
