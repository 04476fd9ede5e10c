// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/material_looks.h"

#include <algorithm>
#include <cmath>

#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

namespace {

// A rougher coat is hardly seen, and costs a random walk at each evaluation.
constexpr float roughest_coat = 0.64f;

// Panes of one sheet that are perfectly clear stay what lets light of windows through.
bool is_clear_pane(const ModelMaterial& m, const ModelSurface& s) {
  return s.transmission >= 1 && s.transmission_map.empty() && !m.has_volume && s.alpha_map.empty() && s.alpha < 0.02f &&
         s.color.min() >= 0.9f && s.color_map.empty() && s.metalness <= 0 && m.clearcoat <= 0 && m.sheen.max() <= 0 &&
         m.film <= 0 && m.specular_tint == RGB(1);
}

// Of what a dielectric mirrors: a colour of at most 1, and the index that gives the rest of it. glTF's colours may be
// above 1: its reflectance at normal incidence is that of the index times the colour, at most 1.
struct Mirroring {
  RGB tint;
  float ior;
};
Mirroring mirroring_of(const ModelMaterial& m, const ModelSurface& s, ModelTextures* textures) {
  const float most = m.specular_tint.max();
  if (most <= 1 || !(m.ior > 1)) return {clamp(m.specular_tint, 0, 1), m.ior};
  if (s.transmission > 0) {
    textures->diagnostics().unsupported(textures->loc(), "a specular colour above 1 of a model's glass", "1");
    return {clamp(m.specular_tint, 0, 1), m.ior};
  }
  constexpr float most_reflected = 0.25f;  // of an index of 3, openpbr's largest
  const float own = sqr((m.ior - 1) / (m.ior + 1));
  if (own * most > most_reflected)
    textures->diagnostics().unsupported(textures->loc(),
                                        "a specular colour with which a model's dielectric mirrors more than a quarter",
                                        own < most_reflected ? "a quarter" : "what the index mirrors");
  const float raised = std::max(std::min(own * most, most_reflected), own);
  const RGB tint = m.specular_tint * (own / raised);
  return {clamp(tint, 0, 1), (1 + std::sqrt(raised)) / (1 - std::sqrt(raised))};
}

std::string principled(const ModelMaterial& m, const ModelSurface& s, const std::string& name,
                       ModelTextures* textures) {
  Directive d("openpbr", textures->loc());
  const auto color = [&](const char* parameter) {
    if (s.color_map.empty())
      d.rgb(parameter, clamp(s.color, 0, 1));
    else
      d.texture(parameter, textures->scaled(true, s.color_map, s.color));
  };
  const auto number = [&](const char* parameter, float value, const std::string& map, float usual) {
    const float unit = std::clamp(value, 0.0f, 1.0f);
    if (unit > 0 && !map.empty())
      d.texture(parameter, textures->scaled(false, map, RGB(unit)));
    else if (unit != usual)
      d.number(parameter, double(unit));
  };
  color("base_color");
  number("base_metalness", s.metalness, s.metalness_map, 0);
  number("specular_roughness", m.roughness, s.alpha_map, 0.3f);
  number("specular_weight", m.specular_weight, "", 1);
  const Mirroring mirroring = mirroring_of(m, s, textures);
  if (!(mirroring.tint == RGB(1))) d.rgb("specular_color", mirroring.tint);
  if (m.film > 0) {
    d.number("thin_film_weight", double(m.film)).number("thin_film_thickness", double(m.film_thickness) / 1000);
    d.number("thin_film_ior", double(m.film_ior));
  }
  number("specular_roughness_anisotropy", m.anisotropy, "", 0);
  if (mirroring.ior != 1.5f) d.number("specular_ior", double(mirroring.ior));
  if (s.transmission > 0) {
    number("transmission_weight", s.transmission, s.transmission_map, 0);
    if (m.attenuation_distance > 0) {
      d.number("transmission_depth", double(m.attenuation_distance));
      d.rgb("transmission_color", clamp(m.attenuation_color, 0, 1));
      if (s.color.min() < 0.99f || !s.color_map.empty())
        textures->diagnostics().unsupported(
            textures->loc(), "a base colour of a model's glass that has a colour by depth", "the colour by depth");
    } else {
      color("transmission_color");
    }
    if (m.dispersion > 0 && m.has_volume)
      d.number("transmission_dispersion_scale", 1)
          .number("transmission_dispersion_abbe_number", 20 / double(m.dispersion));
    if (!m.has_volume) d.boolean("geometry_thin_walled", true);
  }
  if (m.clearcoat > 0) {
    const auto map = [&](const ModelTexture& t, int index) {
      const auto path = textures->picture(t);
      return path ? textures->channel(t, *path, index) : std::string();
    };
    number("coat_weight", m.clearcoat, map(m.clearcoat_map, 0), 0);
    number("coat_roughness", m.clearcoat_roughness, map(m.clearcoat_roughness_map, 1), 0);
    d.number("coat_ior", 1.5).number("coat_darkening", 0);  // as glTF has it
    if (const auto path = textures->picture(m.clearcoat_normal_map)) {
      d.text("coat_normalmap", *path);
      textures->report_strength(m.clearcoat_normal_map);
    }
  }
  if (m.sheen.max() > 0) {
    const float strength = std::min(m.sheen.max(), 1.0f);
    d.number("fuzz_weight", double(strength)).rgb("fuzz_color", clamp(m.sheen / m.sheen.max(), 0, 1));
    number("fuzz_roughness", m.sheen_roughness, "", 0.5f);
  }
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return textures->define_material(name, d.take());
}

// Diffuse light has its whole colour under a highlight: a coat over it (`coateddiffuse`) would halve it.
std::string diffuse_base(const ModelMaterial& m, const ModelSurface& s, const std::string& name,
                         ModelTextures* textures) {
  const bool coated = s.has_highlight && (!s.alpha_map.empty() || s.alpha <= roughest_coat);
  Directive d(coated ? "openpbr" : "diffuse", textures->loc());
  const char* const color = coated ? "base_color" : "reflectance";
  if (s.color_map.empty())
    d.rgb(color, clamp(s.color, 0, 1));
  else
    d.texture(color, textures->scaled(true, s.color_map, s.color));
  if (coated) {
    const float roughness = std::sqrt(s.alpha);
    if (s.alpha_map.empty())
      d.number("specular_roughness", double(roughness));
    else
      d.texture("specular_roughness", textures->scaled(false, s.alpha_map, RGB(roughness)));
    if (m.ior != 1.5f) d.number("specular_ior", double(m.ior));
  }
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return textures->define_material(name, d.take());
}

std::string metal(const ModelSurface& s, const std::string& name, ModelTextures* textures) {
  Directive d("conductor", textures->loc());
  if (s.mirror)
    d.rgb("reflectance", clamp(*s.mirror, 0, 0.99f));
  else if (s.color_map.empty())
    d.rgb("reflectance", clamp(s.color, 0, 0.99f));
  else
    d.texture("reflectance", textures->scaled(true, s.color_map, s.color));
  d.boolean("remaproughness", false);
  if (s.alpha_map.empty())
    d.number("roughness", double(s.alpha));
  else
    d.texture("roughness", textures->scaled(false, textures->squared(s.alpha_map), RGB(s.alpha)));
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return textures->define_material(name, d.take());
}

std::string glass(const ModelMaterial& m, const ModelSurface& s, const std::string& name, ModelTextures* textures) {
  const float alpha = m.kind == ModelMaterial::phong ? 0.0f : s.alpha;
  const bool thin = !m.has_volume && s.alpha_map.empty() && alpha < 0.02f;
  if (s.color.min() < 0.9f || !s.color_map.empty())
    textures->diagnostics().unsupported(textures->loc(), "coloured transmission of a model's material", "clear glass");
  Directive d(thin ? "thindielectric" : "dielectric", textures->loc());
  d.number("eta", double(m.ior));
  if (!thin) {
    d.boolean("remaproughness", false);
    if (s.alpha_map.empty())
      d.number("roughness", double(alpha));
    else
      d.texture("roughness", textures->scaled(false, textures->squared(s.alpha_map), RGB(s.alpha)));
    if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  }
  return textures->define_material(name, d.take());
}

std::string mixed(const std::string& first, const std::string& second, double amount, const std::string& amount_texture,
                  const std::string& name, ModelTextures* textures) {
  Directive d("mix", textures->loc());
  d.text("materials", std::vector<std::string>{first, second});
  if (amount_texture.empty())
    d.number("amount", amount);
  else
    d.texture("amount", textures->scaled(false, amount_texture, RGB(float(amount))));
  return textures->define_material(name, d.take());
}

}  // namespace

namespace {

// glTF's specular numbers are of dielectrics, OpenPBR's of metal, too.
std::string metallic(const ModelMaterial& m, const ModelSurface& s, ModelTextures* textures) {
  if (s.metalness <= 0 || (m.specular_weight == 1 && m.specular_tint == RGB(1)))
    return principled(m, s, m.name, textures);
  ModelMaterial plain = m;
  plain.specular_weight = 1, plain.specular_tint = RGB(1);
  if (s.metalness >= 1 && s.metalness_map.empty()) return principled(plain, s, m.name, textures);
  ModelSurface base = s, metal = s;
  base.metalness = 0, metal.metalness = 1;
  base.metalness_map.clear(), metal.metalness_map.clear();
  return mixed(principled(m, base, m.name + " base", textures), principled(plain, metal, m.name + " metal", textures),
               double(s.metalness), s.metalness_map, m.name, textures);
}

}  // namespace

std::string write_look(const ModelMaterial& m, const ModelSurface& s, ModelTextures* textures) {
  if (m.kind == ModelMaterial::metallic && !is_clear_pane(m, s)) return metallic(m, s, textures);
  const bool all_metal = s.metalness >= 1 && s.metalness_map.empty(),
             all_glass = s.transmission >= 1 && s.transmission_map.empty();
  const std::string& name = m.name;
  const auto part = [&](bool is_whole, const char* suffix) { return is_whole ? name : name + suffix; };
  if (all_metal) return metal(s, name, textures);
  const bool has_metal = s.metalness > 0, has_glass = s.transmission > 0;
  std::string base = all_glass ? glass(m, s, part(!has_metal, " glass"), textures)
                               : diffuse_base(m, s, part(!has_metal && !has_glass, " base"), textures);
  if (has_glass && !all_glass)
    base = mixed(base, glass(m, s, name + " glass", textures), double(s.transmission), s.transmission_map,
                 part(!has_metal, " dielectric"), textures);
  if (!has_metal) return base;
  return mixed(base, metal(s, name + " metal", textures), double(s.metalness), s.metalness_map, name, textures);
}

}  // namespace dapple::modelfile
