// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/material_table.h"

#include <cstring>
#include <type_traits>

#include "dapple/scattering/sheet.h"
#include "dapple/shading/sheet_material.h"

namespace dapple::integrate {

namespace {

// Imath's vectors have copy constructors of their own: compilers copy what contains them number by number.
void copy(const scattering::Bsdf& from, scattering::Bsdf* to) {
  static_assert(std::is_trivially_destructible_v<scattering::Bsdf> && std::is_standard_layout_v<scattering::Bsdf>);
  std::memcpy(static_cast<void*>(to), &from, sizeof from);
}

}  // namespace

MaterialTable::MaterialTable(const scene::Scene& scene, bool caustics) : scene_(scene), caustics_(caustics) {
  for (const shading::MaterialPtr& material : scene.materials) {
    const auto& c = constants_.emplace_back(material->constant());
    needs_tangents_.push_back(!c || c->alpha_x != c->alpha_y || c->base_alpha_x != c->base_alpha_y);
    flat_.push_back(caustics ? material->is_diffuse_to_rays() : material->is_opaque_reflector());
    const shading::StageSet stages = material->stages();
    view_independent_.push_back(material->is_diffuse() && !stages.has(shading::Stage::specularlighting) &&
                                !stages.has(shading::Stage::postlighting));
    flat_constants_.push_back(c);
    if (c && flat_.back()) flat_constants_.back()->flatten();
    const bool mirrors = caustics && material->is_diffuse_to_rays() && !material->is_diffuse();
    work_.push_back(material->work());
    coat_.push_back(!mirrors ? 0 : c ? flat_constants_.back()->mirrored : scattering::CommonCoat::mean);
    passes_.push_back(c && c->kind == scattering::BsdfKind::passthrough);
  }
  rays_pass_ = scene.has_media();
  for (uint32_t g = 0; g < scene.bindings.size(); ++g) {
    rays_pass_ |= passes(g);
    sheet_.push_back(!passes(g) && shading::may_be_sheet(material(g)) && scene.bindings[g].first_light == trace::no_id);
    any_sheet_ |= sheet_.back();
    random_sheet_ |= sheet_.back() && is_random(g);
  }
}

// What chooses at random between glass and others shows the others as diffuse rays see them.
void MaterialTable::flatten(int n, scattering::Bsdf* bsdf) const {
  for (int i = 0; i < n; ++i) {
    const bool mirrors = bsdf[i].is_metal() || bsdf[i].kind == scattering::BsdfKind::measured;
    if (!mirrors || !caustics_) bsdf[i].flatten();
  }
}

void MaterialTable::prelight_constant(int n, const uint32_t* geometry, const geom::SurfacePoint* surface,
                                      scattering::Bsdf* out, For whom) const {
  const auto& constants = whom == For::diffuse_rays ? flat_constants_ : constants_;
  for (int k = 0; k < n; ++k) {
    const size_t m = index(geometry[k]);
    if (!constants[m]) continue;
    copy(*constants[m], &out[k]);
    out[k].frame = needs_tangents_[m] ? Frame(surface[k].Ns, surface[k].dPdu) : Frame(surface[k].Ns);
    out[k].set_geometric_normal(surface[k].Ng);
  }
}

}  // namespace dapple::integrate
