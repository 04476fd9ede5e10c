// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/coverage.h"

#include "dapple/build/material_factory.h"

namespace dapple::build {

using scenefile::MaterialIndex;
using scenefile::Param;
using scenefile::ParamSet;
using scenefile::ParamType;
using scenefile::ShapeEntity;
using scenefile::TextureEntity;

namespace {

// Without a record: whether a parameter is of use is not said here.
const Param* find_texture(const ParamSet& params, std::string_view name) {
  for (const ParamSet* set = &params; set; set = set->defaults().get())
    for (const Param& p : set->all())
      if (p.name == name) return p.type == ParamType::texture && p.strings.size() == 1 ? &p : nullptr;
  return nullptr;
}

const TextureEntity* find_entity(const scenefile::SceneDescription& d, const std::string& name, bool spectrum) {
  const auto& places = spectrum ? d.spectrum_textures : d.float_textures;
  const auto at = places.find(name);
  return at == places.end() ? nullptr : &d.textures[size_t(at->second)];
}

V2i size_of(const std::string& path, const FileLoc& loc) {
  const image::ImageInfo info = image::read_image_info(path, loc);
  return {info.width, info.height};
}

/// The textures, by their place in the description, that materials use, and of these all that they use.
class Reached {
 public:
  explicit Reached(const scenefile::SceneDescription& description) : description_(description) {}

  void add_material(MaterialIndex index) {
    if (!materials_.insert(index).second) return;
    const scenefile::MaterialEntity& entity = description_.materials[size_t(index)];
    add_textures(entity.params);
    if (entity.type != "mix") return;
    for (const Param& p : entity.params.all())
      if (p.name == "materials")
        for (const std::string& name : p.strings)
          if (const auto at = description_.named_materials.find(name); at != description_.named_materials.end())
            add_material(at->second);
  }
  const std::set<int32_t>& textures() const { return textures_; }

 private:
  void add_textures(const ParamSet& params) {
    std::vector<const ParamSet*> open{&params};
    while (!open.empty()) {
      const ParamSet& of = *open.back();
      open.pop_back();
      if (of.defaults()) open.push_back(of.defaults().get());
      for (const Param& p : of.all()) {
        if (p.type != ParamType::texture || p.strings.size() != 1) continue;
        for (const auto* places : {&description_.float_textures, &description_.spectrum_textures})
          if (const auto at = places->find(p.strings[0]); at != places->end() && textures_.insert(at->second).second)
            open.push_back(&description_.textures[size_t(at->second)].params);
      }
    }
  }

  const scenefile::SceneDescription& description_;
  std::set<MaterialIndex> materials_;
  std::set<int32_t> textures_;
};

bool is_weighted_by(const TextureEntity& entity, const Coverage& coverage, const BuildContext& context) {
  if (!entity.is_spectrum || entity.type != "imagemap") return false;
  try {
    return texture_weight(entity, image_params(entity, context), &coverage).by == image::TextureWeight::By::picture;
  } catch (const InputError&) {
    return false;  // said where the texture itself is made
  }
}

}  // namespace

std::string mapping_of(const TextureEntity& entity) {
  std::string text;
  for (const char* name : {"mapping", "uscale", "vscale", "udelta", "vdelta", "v1", "v2", "s", "t", "wrap"}) {
    text += '|';
    for (const Param& p : entity.params.all()) {
      if (p.name != name) continue;
      for (const float v : p.numbers) text += std::to_string(v) + " ";
      for (const std::string& v : p.strings) text += v + " ";
    }
  }
  if (text.find("spherical") == std::string::npos && text.find("cylindrical") == std::string::npos &&
      text.find("planar") == std::string::npos)
    return text;
  for (int i = 0; i < 16; ++i) text += std::to_string(entity.transform.start.matrix()[i / 4][i % 4]) + " ";
  return text;
}

image::TextureWeight texture_weight(const TextureEntity& entity, const ImageParams& image, const Coverage* coverage) {
  using By = image::TextureWeight::By;
  if (!image.weigh_by_alpha) return {By::nothing, {}, {}, 1, false};
  if (!coverage || coverage->mapping != mapping_of(entity) ||
      size_of(coverage->weight.path, image.loc) != size_of(image.path, image.loc))
    return {};
  return coverage->weight;
}

// Parameters of the shape that may say what is cut out, by their names in the file.
std::string CoverageMaterials::picture_name(const ShapeEntity& e) const {
  if (const Param* alpha = find_texture(e.params, "alpha")) return "float " + alpha->strings[0];
  if (const Param* opacity = find_texture(e.params, "opacity")) return "spectrum " + opacity->strings[0];
  return {};
}

std::optional<Coverage> CoverageMaterials::coverage_of(const ShapeEntity& e) const {
  const std::string name = picture_name(e);
  if (name.empty()) return std::nullopt;
  const bool spectrum = name.starts_with("spectrum ");
  const TextureEntity* entity = find_entity(context_.description, name.substr(name.find(' ') + 1), spectrum);
  if (!entity || entity->type != "imagemap") return std::nullopt;
  try {
    const ImageParams image = image_params(*entity, context_);
    std::optional<Coverage> coverage(std::in_place);
    coverage->weight = {image::TextureWeight::By::picture, image.path, image.encoding, image.options.scale,
                        image.options.invert};
    coverage->mapping = mapping_of(*entity);
    return coverage;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

CoverageMaterials::CoverageMaterials(const BuildContext& context, std::vector<shading::MaterialPtr>* materials)
    : context_(context) {
  const auto& d = context.description;
  std::vector<std::pair<Coverage, std::set<MaterialIndex>>> groups;
  std::map<std::pair<MaterialIndex, std::string>, int> group_of;
  const auto look_at = [&](const ShapeEntity& e) {
    const std::string name = picture_name(e);
    if (name.empty() || !group_of.try_emplace({e.material, name}, -1).second) return;
    const std::optional<Coverage> coverage = coverage_of(e);
    if (!coverage) return;
    Reached reached(d);
    reached.add_material(e.material);
    bool any = false;
    for (const int32_t t : reached.textures()) any = any || is_weighted_by(d.textures[size_t(t)], *coverage, context);
    if (!any) return;
    size_t g = 0;
    while (g < groups.size() && !(groups[g].first == *coverage)) ++g;
    if (g == groups.size()) groups.push_back({*coverage, {}});
    groups[g].second.insert(e.material);
    group_of[{e.material, name}] = int(g);
  };
  for (const ShapeEntity& e : d.shapes) look_at(e);
  for (const auto& object : d.objects)
    for (const ShapeEntity& e : object.shapes) look_at(e);

  Diagnostics said_already;
  const BuildContext quiet{d, said_already, context.texture_system, context.keep_going};
  std::vector<std::map<MaterialIndex, uint32_t>> made(groups.size());
  for (size_t g = 0; g < groups.size(); ++g) {
    const auto& [coverage, indices] = groups[g];
    Reached reached(d);
    for (const MaterialIndex i : indices) reached.add_material(i);
    const TextureLibrary textures(quiet, coverage, reached.textures());
    for (const MaterialIndex i : indices) {
      made[g][i] = uint32_t(materials->size());
      materials->push_back(make_material(quiet, textures, i));
    }
  }
  for (const auto& [key, g] : group_of)
    if (g >= 0) made_[key] = made[size_t(g)].at(key.first);
}

uint32_t CoverageMaterials::material_of(const ShapeEntity& e) const {
  if (made_.empty()) return uint32_t(e.material);
  const auto at = made_.find({e.material, picture_name(e)});
  return at == made_.end() ? uint32_t(e.material) : at->second;
}

}  // namespace dapple::build
