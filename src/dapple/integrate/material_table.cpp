// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/material_table.h"

namespace dapple::integrate {

MaterialTable::MaterialTable(const scene::Scene& scene) : scene_(scene) {
  for (const shading::MaterialPtr& material : scene.materials) {
    const auto& c = constants_.emplace_back(material->constant());
    needs_tangents_.push_back(!c || c->alpha_x != c->alpha_y || c->base_alpha_x != c->base_alpha_y);
    passes_.push_back(c && c->kind == shading::BsdfKind::passthrough);
  }
  shadows_pass_ = scene.has_media();
  for (uint32_t g = 0; g < scene.bindings.size(); ++g) shadows_pass_ |= passes(g);
}

void MaterialTable::prelight_constant(int n, const uint32_t* geometry, const geom::SurfacePoint* surface, shading::Bsdf* out) const {
  for (int k = 0; k < n; ++k) {
    const size_t m = index(geometry[k]);
    if (!constants_[m]) continue;
    out[k] = *constants_[m];
    out[k].frame = needs_tangents_[m] ? Frame(surface[k].Ns, surface[k].dPdu) : Frame(surface[k].Ns);
  }
}

}  // namespace dapple::integrate
