// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/surface_material.h"

namespace dapple::shading {

void SurfaceMaterial::settle(bool inputs_constant, float work) {
  varies_ = !inputs_constant;
  input_work_ = work;
  if (varies_) return;
  pattern::ShadingPoints nowhere;  // constant inputs read no lane of it
  nowhere.count = 1;
  scattering::Bsdf bsdf;
  scatter(nowhere, &bsdf);
  constant_ = bsdf;
}

void SurfaceMaterial::prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  if (constant_)
    std::fill_n(out, points.count, *constant_);
  else
    scatter(points, out);
  detail_.write_frames(points, out);
  if (varies_) finish(points, out);
}

}  // namespace dapple::shading
