// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_materials.h"

#include <algorithm>

#include "dapple/modelfile/material_looks.h"
#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

ModelMaterials::ModelMaterials(const Model& model, std::string prefix, const FileLoc& loc,
                               scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder,
                               ModelPictures* pictures, Diagnostics* diagnostics)
    : model_(model), textures_(model, std::move(prefix), loc, description, builder, pictures, diagnostics) {}

void ModelMaterials::add_alpha(const ModelMaterial& m, ShapeLook* look) {
  if (m.alpha == ModelMaterial::opaque) return;
  std::string map;
  if (const auto path = textures_.picture(m.opacity_map))
    map = textures_.image_map(false, m.opacity_map, *path, true, false);
  else if (const auto base = textures_.picture(m.base_map); base && textures_.pictures().has_alpha(*base))
    map = textures_.image_map(false, m.base_map, *base, false, false);
  scenefile::Param p;
  p.name = "alpha", p.loc = textures_.loc();
  if (map.empty()) {
    const float opacity = m.alpha == ModelMaterial::mask ? (m.opacity >= m.alpha_cutoff ? 1.0f : 0.0f) : m.opacity;
    if (opacity >= 1) return;
    p.type = scenefile::ParamType::real, p.numbers = {opacity};
    look->alpha = std::move(p);
    return;
  }
  map = textures_.scaled(false, map, RGB(m.opacity));
  if (m.alpha == ModelMaterial::mask) {
    Directive d("ifgreater", textures_.loc());
    d.texture("value1", map).number("value2", double(m.alpha_cutoff)).number("in1", 1).number("in2", 0);
    map = textures_.define_texture(false, m.name + " mask", d.take());
  }
  p.type = scenefile::ParamType::texture, p.strings = {map};
  look->alpha = std::move(p);
}

void ModelMaterials::add_emission(const ModelMaterial& m, ShapeLook* look) {
  const RGB radiance = m.emission * std::max(m.emission_strength, 0.0f);
  if (!(radiance.max() > 0)) return;
  Directive d("diffuse", textures_.loc());
  if (const auto path = textures_.picture(m.emission_map))
    d.texture("L", textures_.scaled(true, textures_.image_map(true, m.emission_map, *path, false, false), radiance));
  else
    d.rgb("L", radiance);
  d.boolean("twosided", m.two_sided);
  look->emission = d.take();
}

ShapeLook ModelMaterials::make(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture) {
  for (const std::string& what : m.left_out)
    textures_.diagnostics().unsupported(textures_.loc(), what + " of a model's material", "the same without it");
  if (m.kind == ModelMaterial::unlit)
    textures_.diagnostics().unsupported(textures_.loc(), "an unlit material of a model", "a diffuse one of its colour");
  ShapeLook look;
  look.uv_set = textures_.begin(m);
  look.material = write_look(m, surface_of(m, tint, corner_picture, &textures_), &textures_);
  add_alpha(m, &look);
  add_emission(m, &look);
  return look;
}

bool ModelMaterials::wants_corner_colors(const ModelMesh& mesh) const {
  const ModelMaterial& m = model_.materials[mesh.material];
  for (const ModelTexture* t : pictures_of(m))
    if (t->given()) return false;
  return std::any_of(mesh.color.begin(), mesh.color.end(), [&](const RGB& c) { return !(c == mesh.color[0]); });
}

ShapeLook ModelMaterials::look(const ModelMesh& mesh, bool corner_colors) {
  const ModelMaterial& m = model_.materials[mesh.material];
  if (corner_colors) {
    return make(m, RGB(1), textures_.pictures().write_corner_colors(mesh));
  }
  RGB tint(1);
  if (!mesh.color.empty()) {
    RGB sum(0);
    bool varies = false;
    for (const RGB& c : mesh.color) sum += c, varies = varies || !(c == mesh.color[0]);
    tint = varies ? sum / float(mesh.color.size()) : mesh.color[0];
    if (varies)
      textures_.diagnostics().unsupported(textures_.loc(), "colours of vertices that multiply a picture",
                                          "their mean over the mesh");
  }
  const auto key = std::tuple(mesh.material, tint.r, tint.g, tint.b);
  const auto known = looks_.find(key);
  if (known != looks_.end()) return known->second;
  return looks_[key] = make(m, tint, "");
}

}  // namespace dapple::modelfile
