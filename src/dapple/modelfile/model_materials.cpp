// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_materials.h"

#include <algorithm>
#include <cmath>

#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

namespace {

// A rougher coat is hardly seen, and costs a random walk at each evaluation.
constexpr float roughest_coat = 0.64f;

std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 80)) out += c >= 32 && c < 127 && c != '"' && c != '\\' ? c : '_';
  return out;
}

RGB product(const RGB& a, const RGB& b) {
  return RGB(a.r * b.r, a.g * b.g, a.b * b.b);
}

}  // namespace

ModelMaterials::ModelMaterials(const Model& model, std::string prefix, const FileLoc& loc,
                               scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder,
                               ModelPictures* pictures, Diagnostics* diagnostics)
    : model_(model),
      prefix_(std::move(prefix)),
      loc_(loc),
      description_(*description),
      builder_(*builder),
      pictures_(*pictures),
      diagnostics_(*diagnostics) {}

// A name that nothing of its kind has yet.
std::string ModelMaterials::unique(const std::string& name, const char* kind) const {
  const std::string base = prefix_ + (name.empty() ? kind : printable(name));
  const auto taken = [&](const std::string& n) {
    return description_.named_materials.contains(n) || description_.float_textures.contains(n) ||
           description_.spectrum_textures.contains(n);
  };
  if (!taken(base)) return base;
  for (int i = 2;; ++i)
    if (std::string n = base + "." + std::to_string(i); !taken(n)) return n;
}

std::string ModelMaterials::texture(bool is_spectrum, const std::string& name, scenefile::Entity entity) {
  const std::string own = unique(name, "texture");
  builder_.define_texture(own, is_spectrum, std::move(entity));
  return own;
}

std::string ModelMaterials::define(const std::string& name, scenefile::Entity entity) {
  const std::string own = unique(name, "material");
  scenefile::Param type;
  type.name = "type", type.type = scenefile::ParamType::string, type.loc = loc_;
  type.strings = {entity.type};
  entity.params.add(std::move(type));
  builder_.make_named_material(own, std::move(entity));
  return own;
}

std::optional<std::string> ModelMaterials::picture(const ModelTexture& t) {
  if (!t.given()) return std::nullopt;
  const auto same = [&](const ModelMesh& mesh) {
    return mesh.uv[t.uv_set] == mesh.uv[uv_set_] || &model_.materials[mesh.material] != material_;
  };
  if (t.uv_set != uv_set_ && !std::all_of(model_.meshes.begin(), model_.meshes.end(), same)) {
    diagnostics_.unsupported(loc_, "a picture over a second set of texture coordinates", "the material without it");
    return std::nullopt;
  }
  return pictures_.path(t);
}

std::string ModelMaterials::image_map(bool is_spectrum, const ModelTexture& t, const std::string& path, bool is_data,
                                      bool weigh) {
  const std::string key = "image " + path + (is_spectrum ? " s" : " f") + (is_data ? "d" : "c") + (weigh ? "w" : "-") +
                          std::to_string(t.wrap);
  std::string& name = textures_[key];
  if (!name.empty()) return name;
  const size_t slash = path.rfind('/');
  std::string stem = path.substr(slash + 1);
  stem = stem.substr(0, stem.rfind('.'));
  Directive d("imagemap", loc_);
  d.text("filename", path);
  if (is_data) d.text("encoding", "linear");
  if (t.wrap == 1) d.text("wrap", "clamp");
  if (t.wrap == 2)
    diagnostics_.warn(loc_, "pictures that repeat mirrored repeat as they are", "mirrored repeat " + loc_.to_string());
  if (is_spectrum && !weigh) d.boolean("weightbyalpha", false);
  return name = texture(is_spectrum, stem, d.take());
}

std::string ModelMaterials::scaled(bool is_spectrum, const std::string& of, const RGB& factor) {
  if (factor == RGB(1)) return of;
  char numbers[80];
  std::snprintf(numbers, sizeof numbers, " times %g %g %g", double(factor.r), double(factor.g), double(factor.b));
  std::string& name = textures_[of + numbers + (is_spectrum ? " s" : " f")];
  if (!name.empty()) return name;
  Directive d("multiply", loc_);
  d.texture("in1", of);
  if (is_spectrum)
    d.rgb("in2", factor);
  else
    d.number("in2", double(factor.r));
  return name = texture(is_spectrum, of.substr(prefix_.size()) + " scaled", d.take());
}

std::string ModelMaterials::channel(const ModelTexture& t, const std::string& path, int index) {
  const std::string whole = image_map(true, t, path, true, false);
  std::string& name = textures_[whole + " channel " + std::to_string(index)];
  if (!name.empty()) return name;
  Directive d("extract", loc_);
  d.texture("in", whole).integer("index", index);
  static constexpr const char* suffixes[] = {" red", " green", " blue"};
  return name = texture(false, whole.substr(prefix_.size()) + suffixes[index], d.take());
}

std::string ModelMaterials::squared(const std::string& of) {
  std::string& name = textures_[of + " squared"];
  if (!name.empty()) return name;
  Directive d("multiply", loc_);
  d.texture("in1", of).texture("in2", of);
  return name = texture(false, of.substr(prefix_.size()) + " squared", d.take());
}

// Shapes have one set of coordinates: that of the colour, else of the first picture.
uint32_t ModelMaterials::choose_uv_set(const ModelMaterial& m) const {
  for (const ModelTexture* t : {&m.base_map, &m.normal_map, &m.roughness_map, &m.metalness_map, &m.emission_map,
                                &m.opacity_map, &m.transmission_map, &m.bump_map})
    if (t->given()) return t->uv_set;
  return 0;
}

ModelMaterials::Surface ModelMaterials::surface_of(const ModelMaterial& m, const RGB& tint,
                                                   const std::string& corner_picture) {
  Surface s;
  s.color = product(m.base, tint);
  if (const auto path = picture(m.base_map))
    s.color_map = image_map(true, m.base_map, *path, false, m.alpha != ModelMaterial::opaque);
  else if (!corner_picture.empty())
    s.color_map = image_map(true, {}, corner_picture, false, false);
  const auto map = [&](const ModelTexture& t, int index) {
    const auto path = picture(t);
    return path ? channel(t, *path, index) : std::string();
  };
  s.transmission = m.transmission;
  if (m.transmission > 0) s.transmission_map = map(m.transmission_map, 0);
  switch (m.kind) {
    case ModelMaterial::metallic:
      s.metalness = std::clamp(m.metalness, 0.0f, 1.0f);
      if (s.metalness > 0) s.metalness_map = map(m.metalness_map, m.metal_rough_map ? 2 : 0);
      s.alpha = sqr(std::clamp(m.roughness, 0.0f, 1.0f));
      if (s.alpha > 0) s.alpha_map = map(m.roughness_map, m.metal_rough_map ? 1 : 0);
      break;
    case ModelMaterial::specular:
      s.alpha = sqr(1 - std::clamp(m.glossiness, 0.0f, 1.0f));
      // Dielectrics reflect a few per cent; what reflects more is a metal to that share.
      s.metalness = std::clamp((m.specular_color.max() - 0.2f) / 0.6f, 0.0f, 1.0f);
      s.mirror = m.specular_color;
      break;
    case ModelMaterial::phong:
      s.alpha = std::sqrt(2 / (std::max(m.exponent, 0.0f) + 2));
      s.has_highlight = m.specular_color.max() > 0.02f;
      if (m.specular_color.max() > 0.5f && m.base.max() < 0.02f && !m.base_map.given()) {
        s.metalness = 1;
        s.mirror = m.specular_color;
      }
      if (m.reflectivity > 0.5f && m.reflectivity <= 1 && s.metalness == 0) {
        s.metalness = m.reflectivity;
        s.mirror = m.specular_color.max() > 0.02f ? m.specular_color : RGB(1);
        s.alpha = 0;
      }
      break;
    case ModelMaterial::unlit:
      s.has_highlight = false;
      break;
  }
  if (const auto path = picture(m.normal_map)) s.normal_map = *path;
  if (!s.normal_map.empty() && std::abs(m.normal_map.strength - 1) > 0.01f)
    diagnostics_.unsupported(loc_, "the strength of a normal map of a model", "the map as it is");
  if (s.normal_map.empty())
    if (const auto path = picture(m.bump_map)) {
      if (pictures_.is_normal_map(*path))
        s.normal_map = *path;
      else
        diagnostics_.warn(loc_, "heights of bump maps have no unit in models: \"" + m.name + "\" is rendered without",
                          "bump map " + *path);
    }
  return s;
}

std::string ModelMaterials::diffuse_base(const ModelMaterial& m, const Surface& s, const std::string& name) {
  const bool coated = s.has_highlight && (!s.alpha_map.empty() || s.alpha <= roughest_coat);
  Directive d(coated ? "coateddiffuse" : "diffuse", loc_);
  if (s.color_map.empty())
    d.rgb("reflectance", clamp(s.color, 0, 1));
  else
    d.texture("reflectance", scaled(true, s.color_map, s.color));
  if (coated) {
    d.boolean("remaproughness", false);
    if (s.alpha_map.empty())
      d.number("roughness", double(s.alpha));
    else
      d.texture("roughness", scaled(false, squared(s.alpha_map), RGB(s.alpha)));
    d.number("eta", double(m.ior));
  }
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return define(name, d.take());
}

std::string ModelMaterials::metal(const Surface& s, const std::string& name) {
  Directive d("conductor", loc_);
  if (s.mirror)
    d.rgb("reflectance", clamp(*s.mirror, 0, 0.99f));
  else if (s.color_map.empty())
    d.rgb("reflectance", clamp(s.color, 0, 0.99f));
  else
    d.texture("reflectance", scaled(true, s.color_map, s.color));
  d.boolean("remaproughness", false);
  if (s.alpha_map.empty())
    d.number("roughness", double(s.alpha));
  else
    d.texture("roughness", scaled(false, squared(s.alpha_map), RGB(s.alpha)));
  if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  return define(name, d.take());
}

std::string ModelMaterials::glass(const ModelMaterial& m, const Surface& s, const std::string& name) {
  const float alpha = m.kind == ModelMaterial::phong ? 0.0f : s.alpha;
  const bool thin = !m.has_volume && s.alpha_map.empty() && alpha < 0.02f;
  if (s.color.min() < 0.9f || !s.color_map.empty())
    diagnostics_.unsupported(loc_, "coloured transmission of a model's material", "clear glass");
  Directive d(thin ? "thindielectric" : "dielectric", loc_);
  d.number("eta", double(m.ior));
  if (!thin) {
    d.boolean("remaproughness", false);
    if (s.alpha_map.empty())
      d.number("roughness", double(alpha));
    else
      d.texture("roughness", scaled(false, squared(s.alpha_map), RGB(s.alpha)));
    if (!s.normal_map.empty()) d.text("normalmap", s.normal_map);
  }
  return define(name, d.take());
}

std::string ModelMaterials::mixed(const std::string& first, const std::string& second, double amount,
                                  const std::string& amount_texture, const std::string& name) {
  Directive d("mix", loc_);
  d.text("materials", std::vector<std::string>{first, second});
  if (amount_texture.empty())
    d.number("amount", amount);
  else
    d.texture("amount", scaled(false, amount_texture, RGB(float(amount))));
  return define(name, d.take());
}

void ModelMaterials::add_alpha(const ModelMaterial& m, ShapeLook* look) {
  if (m.alpha == ModelMaterial::opaque) return;
  std::string map;
  if (const auto path = picture(m.opacity_map))
    map = image_map(false, m.opacity_map, *path, true, false);
  else if (const auto base = picture(m.base_map); base && pictures_.has_alpha(*base))
    map = image_map(false, m.base_map, *base, false, false);
  scenefile::Param p;
  p.name = "alpha", p.loc = loc_;
  if (map.empty()) {
    const float opacity = m.alpha == ModelMaterial::mask ? (m.opacity >= m.alpha_cutoff ? 1.0f : 0.0f) : m.opacity;
    if (opacity >= 1) return;
    p.type = scenefile::ParamType::real, p.numbers = {opacity};
    look->alpha = std::move(p);
    return;
  }
  map = scaled(false, map, RGB(m.opacity));
  if (m.alpha == ModelMaterial::mask) {
    Directive d("ifgreater", loc_);
    d.texture("value1", map).number("value2", double(m.alpha_cutoff)).number("in1", 1).number("in2", 0);
    map = texture(false, m.name + " mask", d.take());
  }
  p.type = scenefile::ParamType::texture, p.strings = {map};
  look->alpha = std::move(p);
}

void ModelMaterials::add_emission(const ModelMaterial& m, ShapeLook* look) {
  const RGB radiance = m.emission * std::max(m.emission_strength, 0.0f);
  if (!(radiance.max() > 0)) return;
  Directive d("diffuse", loc_);
  if (const auto path = picture(m.emission_map))
    d.texture("L", scaled(true, image_map(true, m.emission_map, *path, false, false), radiance));
  else
    d.rgb("L", radiance);
  d.boolean("twosided", m.two_sided);
  look->emission = d.take();
}

ShapeLook ModelMaterials::make(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture) {
  for (const std::string& what : m.left_out)
    diagnostics_.unsupported(loc_, what + " of a model's material", "the same without it");
  if (m.kind == ModelMaterial::unlit)
    diagnostics_.unsupported(loc_, "an unlit material of a model", "a diffuse one of its colour");
  ShapeLook look;
  material_ = &m;
  look.uv_set = uv_set_ = choose_uv_set(m);
  const Surface s = surface_of(m, tint, corner_picture);
  if (m.kind == ModelMaterial::metallic && !is_clear_pane(m, s)) {
    look.material = principled(m, s, m.name);
    add_alpha(m, &look);
    add_emission(m, &look);
    return look;
  }
  const bool all_metal = s.metalness >= 1 && s.metalness_map.empty(),
             all_glass = s.transmission >= 1 && s.transmission_map.empty();
  const std::string name = m.name;
  const auto part = [&](bool is_whole, const char* suffix) { return is_whole ? name : name + suffix; };
  if (all_metal) {
    look.material = metal(s, name);
  } else {
    const bool has_metal = s.metalness > 0, has_glass = s.transmission > 0;
    std::string base = all_glass ? glass(m, s, part(!has_metal, " glass"))
                                 : diffuse_base(m, s, part(!has_metal && !has_glass, " base"));
    if (has_glass && !all_glass)
      base = mixed(base, glass(m, s, name + " glass"), double(s.transmission), s.transmission_map,
                   part(!has_metal, " dielectric"));
    look.material =
        has_metal ? mixed(base, metal(s, name + " metal"), double(s.metalness), s.metalness_map, name) : base;
  }
  add_alpha(m, &look);
  add_emission(m, &look);
  return look;
}

bool ModelMaterials::wants_corner_colors(const ModelMesh& mesh) const {
  const ModelMaterial& m = model_.materials[mesh.material];
  for (const ModelTexture* t : {&m.base_map, &m.normal_map, &m.roughness_map, &m.metalness_map, &m.emission_map,
                                &m.opacity_map, &m.transmission_map, &m.bump_map})
    if (t->given()) return false;
  return std::any_of(mesh.color.begin(), mesh.color.end(), [&](const RGB& c) { return !(c == mesh.color[0]); });
}

ShapeLook ModelMaterials::look(const ModelMesh& mesh, bool corner_colors) {
  const ModelMaterial& m = model_.materials[mesh.material];
  if (corner_colors) {
    return make(m, RGB(1), pictures_.write_corner_colors(mesh));
  }
  RGB tint(1);
  if (!mesh.color.empty()) {
    RGB sum(0);
    bool varies = false;
    for (const RGB& c : mesh.color) sum += c, varies = varies || !(c == mesh.color[0]);
    tint = varies ? sum / float(mesh.color.size()) : mesh.color[0];
    if (varies)
      diagnostics_.unsupported(loc_, "colours of vertices that multiply a picture", "their mean over the mesh");
  }
  const auto key = std::tuple(mesh.material, tint.r, tint.g, tint.b);
  const auto known = looks_.find(key);
  if (known != looks_.end()) return known->second;
  return looks_[key] = make(m, tint, "");
}

}  // namespace dapple::modelfile
