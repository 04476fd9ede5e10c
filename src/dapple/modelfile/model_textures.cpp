// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_textures.h"

#include <algorithm>
#include <cmath>

#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

namespace {

std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 80)) out += c >= 32 && c < 127 && c != '"' && c != '\\' ? c : '_';
  return out;
}

}  // namespace

std::array<const ModelTexture*, 11> pictures_of(const ModelMaterial& m) {
  return {&m.base_map,
          &m.normal_map,
          &m.roughness_map,
          &m.metalness_map,
          &m.emission_map,
          &m.opacity_map,
          &m.transmission_map,
          &m.bump_map,
          &m.clearcoat_map,
          &m.clearcoat_roughness_map,
          &m.clearcoat_normal_map};
}

ModelTextures::ModelTextures(const Model& model, std::string prefix, const FileLoc& loc,
                             scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder,
                             ModelPictures* pictures, Diagnostics* diagnostics)
    : model_(model),
      prefix_(std::move(prefix)),
      loc_(loc),
      description_(*description),
      builder_(*builder),
      pictures_(*pictures),
      diagnostics_(*diagnostics) {}

uint32_t ModelTextures::begin(const ModelMaterial& m) {
  material_ = &m;
  uv_set_ = 0;
  for (const ModelTexture* t : pictures_of(m))
    if (t->given()) return uv_set_ = t->uv_set;
  return uv_set_;
}

std::optional<std::string> ModelTextures::picture(const ModelTexture& t) {
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

void ModelTextures::report_strength(const ModelTexture& t) {
  if (std::abs(t.strength - 1) > 0.01f)
    diagnostics_.unsupported(loc_, "the strength of a normal map of a model", "the map as it is");
}

// A name that nothing of its kind has yet.
std::string ModelTextures::unique(const std::string& name, const char* kind) const {
  const std::string base = prefix_ + (name.empty() ? kind : printable(name));
  const auto taken = [&](const std::string& n) {
    return description_.named_materials.contains(n) || description_.float_textures.contains(n) ||
           description_.spectrum_textures.contains(n);
  };
  if (!taken(base)) return base;
  for (int i = 2;; ++i)
    if (std::string n = base + "." + std::to_string(i); !taken(n)) return n;
}

std::string ModelTextures::define_texture(bool is_spectrum, const std::string& name, scenefile::Entity entity) {
  const std::string own = unique(name, "texture");
  builder_.define_texture(own, is_spectrum, std::move(entity));
  return own;
}

std::string ModelTextures::define_material(const std::string& name, scenefile::Entity entity) {
  const std::string own = unique(name, "material");
  scenefile::Param type;
  type.name = "type", type.type = scenefile::ParamType::string, type.loc = loc_;
  type.strings = {entity.type};
  entity.params.add(std::move(type));
  builder_.make_named_material(own, std::move(entity));
  return own;
}

std::string ModelTextures::image_map(bool is_spectrum, const ModelTexture& t, const std::string& path, bool is_data,
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
  return name = define_texture(is_spectrum, stem, d.take());
}

std::string ModelTextures::scaled(bool is_spectrum, const std::string& of, const RGB& factor) {
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
  return name = define_texture(is_spectrum, of.substr(prefix_.size()) + " scaled", d.take());
}

std::string ModelTextures::channel(const ModelTexture& t, const std::string& path, int index) {
  const std::string whole = image_map(true, t, path, true, false);
  std::string& name = textures_[whole + " channel " + std::to_string(index)];
  if (!name.empty()) return name;
  Directive d("extract", loc_);
  d.texture("in", whole).integer("index", index);
  static constexpr const char* suffixes[] = {" red", " green", " blue"};
  return name = define_texture(false, whole.substr(prefix_.size()) + suffixes[index], d.take());
}

std::string ModelTextures::squared(const std::string& of) {
  std::string& name = textures_[of + " squared"];
  if (!name.empty()) return name;
  Directive d("multiply", loc_);
  d.texture("in1", of).texture("in2", of);
  return name = define_texture(false, of.substr(prefix_.size()) + " squared", d.take());
}

}  // namespace dapple::modelfile
