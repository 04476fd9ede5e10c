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

}  // namespace dapple::integrate
