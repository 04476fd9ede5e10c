// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_extensions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

namespace dapple::modelfile {

namespace {

using nlohmann::json;

/// The text of a .gltf file, or of the first chunk of a .glb file.
std::string json_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = size_t(std::max<std::streamoff>(in.tellg(), 0));
  constexpr size_t header = 20;  // magic, version, length; length and type of the chunk
  const auto read = [&](size_t from, size_t count) {
    std::string text(count, '\0');
    in.seekg(std::streamoff(from));
    in.read(text.data(), std::streamsize(count));
    text.resize(size_t(std::max<std::streamsize>(in.gcount(), 0)));
    return text;
  };
  const std::string begin = read(0, std::min(size, header));
  if (begin.size() < header || begin.compare(0, 4, "glTF") != 0) return read(0, size);
  uint32_t length = 0;
  std::memcpy(&length, begin.data() + 12, sizeof length);
  return read(header, std::min(size_t(length), size - header));
}

const json* member(const json& of, const char* name) {
  if (!of.is_object()) return nullptr;
  const auto it = of.find(name);
  return it == of.end() ? nullptr : &*it;
}

float number(const json& of, const char* name, float fallback) {
  const json* value = member(of, name);
  if (!value || !value->is_number()) return fallback;
  const double v = value->get<double>();
  return std::isfinite(v) ? float(std::clamp(v, -1e6, 1e6)) : fallback;
}

RGB color(const json& of, const char* name, const RGB& fallback) {
  const json* value = member(of, name);
  if (!value || !value->is_array() || value->size() != 3) return fallback;
  RGB out;
  for (size_t c = 0; c < 3; ++c) {
    if (!(*value)[c].is_number()) return fallback;
    const double v = (*value)[c].get<double>();
    out[int(c)] = v > 0 ? float(std::min(v, 1e6)) : 0;
  }
  return out;
}

float element(const json& of, const char* name, size_t i, float fallback) {
  const json* list = member(of, name);
  if (!list || !list->is_array() || i >= list->size() || !(*list)[i].is_number()) return fallback;
  const double v = (*list)[i].get<double>();
  return std::isfinite(v) ? float(std::clamp(v, -1e6, 1e6)) : fallback;
}

std::string printable(const std::string& name) {
  std::string out;
  for (const char c : name.substr(0, 60)) out += c >= 32 && c < 127 ? c : '_';
  return out;
}

// KHR_texture_transform, whose v runs downwards, for v that runs upwards.
UvTransform transform_of(const json& texture) {
  const json* extensions = member(texture, "extensions");
  const json* e = extensions ? member(*extensions, "KHR_texture_transform") : nullptr;
  if (!e) return {};
  const float angle = number(*e, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  const float sx = element(*e, "scale", 0, 1), sy = element(*e, "scale", 1, 1);
  const V2f of_u(c * sx, s * sy), of_v(-s * sx, c * sy);
  UvTransform t;
  t.u = V2f(of_u.x, -of_u.y);
  t.v = V2f(-of_v.x, of_v.y);
  t.offset = V2f(element(*e, "offset", 0, 0) + of_u.y, 1 - element(*e, "offset", 1, 0) - of_v.y);
  return t;
}

class Extensions {
 public:
  Extensions(const json& of, ModelMaterial* m) : of_(of), m_(*m) {}

  void read() {
    if (!of_.is_object()) return;
    if (const json* e = member(of_, "KHR_materials_iridescence")) read_iridescence(*e);
    if (const json* e = member(of_, "KHR_materials_anisotropy")) read_anisotropy(*e);
    if (const json* e = member(of_, "KHR_materials_specular")) read_specular(*e);
    if (const json* e = member(of_, "KHR_materials_emissive_strength"))
      m_.emission_strength = std::max(number(*e, "emissiveStrength", 1), 0.0f);
    if (const json* e = member(of_, "KHR_materials_clearcoat"))
      if (const json* map = member(*e, "clearcoatNormalTexture"))
        m_.clearcoat_normal_map.strength = number(*map, "scale", 1);
    if (const json* e = member(of_, "KHR_materials_volume")) read_volume(*e);
    if (const json* e = member(of_, "KHR_materials_dispersion"))
      m_.dispersion = std::clamp(number(*e, "dispersion", 0), 0.0f, 100.0f);
    name_the_others();
  }

 private:
  void leave_out(const std::string& what) { m_.left_out.push_back(what); }

  void read_iridescence(const json& e) {
    m_.film = std::clamp(number(e, "iridescenceFactor", 0), 0.0f, 1.0f);
    if (m_.film <= 0) return;
    m_.film_ior = std::clamp(number(e, "iridescenceIor", 1.3f), 1.0f, 3.0f);
    m_.film_thickness = std::max(number(e, "iridescenceThicknessMaximum", 400), 0.0f);
    if (member(e, "iridescenceTexture") || member(e, "iridescenceThicknessTexture"))
      leave_out("pictures of iridescence");
  }

  // Along the tangent alpha is that of the roughness, widened to 1 by the square of the strength; across it stays.
  void read_anisotropy(const json& e) {
    const float strength = std::clamp(number(e, "anisotropyStrength", 0), 0.0f, 1.0f);
    if (strength <= 0) return;
    if (m_.roughness_map.given()) return leave_out("anisotropy beside a picture of roughness");
    const float across = sqr(std::clamp(m_.roughness, 0.0f, 1.0f)), along = across + (1 - across) * sqr(strength);
    const float narrow = across / along;
    m_.anisotropy = 1 - narrow;
    m_.roughness = std::min(std::sqrt(along / std::sqrt(2 / (1 + sqr(narrow)))), 1.0f);
    if (std::abs(number(e, "anisotropyRotation", 0)) > 1e-3f) leave_out("the direction of anisotropy");
    if (member(e, "anisotropyTexture")) leave_out("pictures of anisotropy");
  }

  void read_specular(const json& e) {
    m_.specular_weight = std::clamp(number(e, "specularFactor", 1), 0.0f, 1.0f);
    m_.specular_tint = color(e, "specularColorFactor", RGB(1));
    if (member(e, "specularTexture") || member(e, "specularColorTexture")) leave_out("pictures of specular");
  }

  void read_volume(const json& e) {
    if (!(number(e, "thicknessFactor", 0) > 0)) return;
    m_.has_volume = true;
    m_.attenuation_distance = std::max(number(e, "attenuationDistance", 0), 0.0f);
    m_.attenuation_color = color(e, "attenuationColor", RGB(1));
  }

  void name_the_others() {
    static constexpr std::array known = {"KHR_materials_iridescence",
                                         "KHR_materials_anisotropy",
                                         "KHR_materials_specular",
                                         "KHR_materials_dispersion",
                                         "KHR_materials_clearcoat",
                                         "KHR_materials_sheen",
                                         "KHR_materials_volume",
                                         "KHR_materials_ior",
                                         "KHR_materials_transmission",
                                         "KHR_materials_unlit",
                                         "KHR_materials_variants",
                                         "KHR_materials_emissive_strength",
                                         "KHR_materials_pbrSpecularGlossiness"};
    for (const auto& [name, value] : of_.items()) {
      if (std::find(known.begin(), known.end(), name) == known.end()) leave_out("extension " + printable(name));
    }
  }

  const json& of_;
  ModelMaterial& m_;
};

// Those of nodes, meshes, pictures: what materials use is named with them.
void name_unknown_extensions(const json& file, Model* model) {
  static constexpr std::array known = {"KHR_draco_mesh_compression", "KHR_lights_punctual", "KHR_mesh_quantization",
                                       "KHR_texture_transform"};
  const json* names = member(file, "extensionsUsed");
  if (!names || !names->is_array()) return;
  for (const json& name : *names) {
    const std::string text = name.is_string() ? name.get<std::string>() : "";
    if (text.empty() || (text.starts_with("KHR_materials_") && text != "KHR_materials_variants")) continue;
    if (std::find(known.begin(), known.end(), text) == known.end())
      model->left_out.push_back("extension " + printable(text));
  }
}

// The pictures of a material in the order in which they decide about texture coordinates.
std::vector<const json*> textures_of(const json& material) {
  std::vector<const json*> out;
  const auto add = [&](const json* in, std::initializer_list<const char*> names) {
    if (!in) return;
    for (const char* name : names)
      if (const json* texture = member(*in, name)) out.push_back(texture);
  };
  add(member(material, "pbrMetallicRoughness"), {"baseColorTexture"});
  add(&material, {"normalTexture"});
  add(member(material, "pbrMetallicRoughness"), {"metallicRoughnessTexture"});
  add(&material, {"emissiveTexture"});
  if (const json* extensions = member(material, "extensions")) {
    add(member(*extensions, "KHR_materials_pbrSpecularGlossiness"), {"diffuseTexture"});
    add(member(*extensions, "KHR_materials_transmission"), {"transmissionTexture"});
    add(member(*extensions, "KHR_materials_clearcoat"),
        {"clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture"});
  }
  return out;
}

// There is one set of coordinates for all pictures.
void read_transforms(const json& material, ModelMaterial* m) {
  const std::vector<const json*> textures = textures_of(material);
  if (textures.empty()) return;
  m->uv_transform = transform_of(*textures.front());
  const auto differs = [&](const json* t) { return !(transform_of(*t) == m->uv_transform); };
  if (std::any_of(textures.begin(), textures.end(), differs))
    m->left_out.push_back("texture transforms that differ from the first one's");
}

}  // namespace

void add_gltf_extensions(const std::string& path, Model* model) {
  const json file = json::parse(json_text(path), nullptr, false);
  name_unknown_extensions(file, model);
  const json* materials = member(file, "materials");
  if (!materials || !materials->is_array()) return;
  const auto name_of = [](const json& material) {
    const json* name = member(material, "name");
    return name && name->is_string() ? name->get<std::string>() : std::string();
  };
  // Assimp keeps the order of the file, or takes that of their first use: then only names tell.
  const auto find = [&](size_t i) -> ModelMaterial* {
    auto& all = model->materials;
    const std::string name = name_of((*materials)[i]);
    if (i < all.size() && all[i].name == name) return &all[i];
    const auto is_it = [&](const ModelMaterial& m) { return m.name == name; };
    const auto found = std::find_if(all.begin(), all.end(), is_it);
    const auto named = std::count_if(materials->begin(), materials->end(),
                                     [&](const json& material) { return name_of(material) == name; });
    return named == 1 && std::count_if(all.begin(), all.end(), is_it) == 1 ? &*found : nullptr;
  };
  for (size_t i = 0; i < materials->size(); ++i) {
    const json& material = (*materials)[i];
    const json* extensions = member(material, "extensions");
    if (ModelMaterial* const m = find(i)) {
      read_transforms(material, m);
      if (extensions) Extensions(*extensions, m).read();
    } else if (extensions && i < model->materials.size()) {
      model->materials[i].left_out.push_back("some extensions (its name is not its own)");
    }
  }
}

}  // namespace dapple::modelfile
