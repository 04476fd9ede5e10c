// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/material_factory.h"

#include <algorithm>

#include "dapple/build/hair_factory.h"
#include "dapple/build/material_params.h"
#include "dapple/build/measured_factory.h"
#include "dapple/build/openpbr_factory.h"
#include "dapple/build/plugin_factory.h"
#include "dapple/build/subsurface_factory.h"
#include "dapple/shading/coated_material.h"
#include "dapple/shading/dielectric_material.h"
#include "dapple/shading/diffuse_material.h"
#include "dapple/shading/mix_material.h"

namespace dapple::build {

using pattern::Input;
using scenefile::MaterialEntity;
using scenefile::MaterialIndex;
using shading::MaterialPtr;

namespace {

// Each level of a mix holds a batch on the stack.
constexpr int max_mix_levels = 16;

MaterialPtr make_diffuse(const MaterialParams& p) {
  return std::make_shared<shading::DiffuseMaterial>(p.reflectance("reflectance", RGB(0.5f)), p.detail());
}

MaterialPtr make_diffuse_transmission(const MaterialParams& p) {
  const Input<RGB> reflectance = p.reflectance("reflectance", RGB(0.25f)),
                   transmittance = p.reflectance("transmittance", RGB(0.25f));
  const float scale = p.constant("scale", 1);
  if (reflectance.constant() && transmittance.constant()) {
    const RGB sum = clamp(*reflectance.constant() * scale, 0, 1) + clamp(*transmittance.constant() * scale, 0, 1);
    constexpr float rounding = 1e-5f;
    if (sum.max() > 1 + rounding)
      p.warn("\"reflectance\" and \"transmittance\" add up to " + std::to_string(sum.max()) +
             "; above 1 the surface creates energy");
  }
  return std::make_shared<shading::DiffuseTransmissionMaterial>(reflectance, transmittance, scale, p.detail());
}

MaterialPtr make_conductor(const MaterialParams& p) {
  return std::make_shared<shading::ConductorMaterial>(p.metal("", 1), p.roughness(), p.detail());
}

MaterialPtr make_dielectric(const MaterialParams& p) {
  return std::make_shared<shading::DielectricMaterial>(p.ior("eta", 1.5f), p.roughness(), p.detail());
}

MaterialPtr make_thin_dielectric(const MaterialParams& p) {
  return std::make_shared<shading::ThinDielectricMaterial>(p.ior("eta", 1.5f), p.detail());
}

MaterialPtr make_coated_diffuse(const MaterialParams& p) {
  return std::make_shared<shading::CoatedDiffuseMaterial>(p.reflectance("reflectance", RGB(0.5f)), p.coat(""),
                                                          p.detail());
}

MaterialPtr make_coated_conductor(const MaterialParams& p) {
  shading::CoatInput coat = p.coat("interface.");
  shading::MetalInput metal = p.metal("conductor.", coat.ior);
  return std::make_shared<shading::CoatedConductorMaterial>(std::move(metal), p.roughness("conductor."),
                                                            std::move(coat), p.detail());
}

MaterialPtr make_interface(const MaterialParams&) {
  return std::make_shared<shading::InterfaceMaterial>();
}

struct MaterialType {
  std::string_view name;
  MaterialPtr (*make)(const MaterialParams&);
};

constexpr MaterialType types[] = {
    {"diffuse", make_diffuse},
    {"diffusetransmission", make_diffuse_transmission},
    {"conductor", make_conductor},
    {"dielectric", make_dielectric},
    {"thindielectric", make_thin_dielectric},
    {"coateddiffuse", make_coated_diffuse},
    {"coatedconductor", make_coated_conductor},
    {"interface", make_interface},
    {"subsurface", make_subsurface},
    {"openpbr", make_openpbr},
    {"hair", make_hair},
    {"measured", make_measured},
};

std::string list_of_types() {
  std::vector<std::string_view> names;
  for (const MaterialType& type : types) names.push_back(type.name);
  names.push_back("mix");
  names.push_back("plugin");
  return one_of(names);
}

/// Makes materials on demand, so that a mix may name any other.
class MaterialBuilder {
 public:
  MaterialBuilder(const BuildContext& context, const TextureLibrary& textures)
      : context_(context),
        textures_(textures),
        plugins_(context, textures),
        made_(context.description.materials.size()) {}

  std::vector<MaterialPtr> build() {
    std::vector<MaterialPtr> materials;
    for (size_t i = 0; i < made_.size(); ++i) materials.push_back(get(static_cast<MaterialIndex>(i), 0).material);
    return materials;
  }
  MaterialPtr build(MaterialIndex index) { return get(index, 0).material; }

 private:
  struct Made {
    MaterialPtr material;
    int mix_levels = 0;
    bool in_progress = false;
  };

  const Made& get(MaterialIndex index, int level) {
    Made& made = made_[static_cast<size_t>(index)];
    if (made.material) return made;
    const MaterialEntity& entity = context_.description.materials[static_cast<size_t>(index)];
    if (made.in_progress) throw InputError(entity.loc, "the mix \"" + entity.name + "\" contains itself");
    made.in_progress = true;
    if (entity.type == "mix")
      make_mix(entity, index, level, &made);
    else if (entity.type == "plugin")
      made.material = plugins_.make(entity);
    else
      made.material = make(entity);
    entity.params.report_unused("material \"" + entity.type + "\"", context_.diagnostics);
    return made;
  }

  MaterialPtr make(const MaterialEntity& entity) {
    const std::string_view name =
        entity.type.empty() || entity.type == "none" ? "interface" : std::string_view(entity.type);
    const auto* type =
        std::find_if(std::begin(types), std::end(types), [&](const MaterialType& t) { return t.name == name; });
    if (type == std::end(types))
      throw InputError(entity.loc, "unknown material \"" + entity.type + "\"; " + list_of_types());
    return type->make(MaterialParams(entity, context_, textures_));
  }

  void make_mix(const MaterialEntity& entity, MaterialIndex index, int level, Made* made) {
    const auto too_deep = [&] {
      return InputError(entity.loc, "mixes nest more than " + std::to_string(max_mix_levels) + " levels deep");
    };
    if (level >= max_mix_levels) throw too_deep();
    const auto names = entity.params.get_strings("materials");
    if (names.size() != 2)
      throw InputError(entity.loc,
                       "a mix has " + std::to_string(names.size()) + " \"materials\"; expected the names of two");
    const Made& first = part(entity, names[0], level);
    const Made& second = part(entity, names[1], level);
    for (const Made* m : {&first, &second})
      if (m->material->stages() != shading::StageSet{shading::Stage::prelighting})
        context_.diagnostics.unsupported(entity.loc, "a mix of shaders that have other stages than prelighting",
                                         "a mix of what their prelighting gives");
    for (const std::string& name : names)
      if (has_interior(context_.description.materials[size_t(context_.description.named_materials.at(name))]))
        context_.diagnostics.unsupported(entity.loc, "\"transmission_depth\" of a material in a mix",
                                         "a clear inside; a MediumInterface fills it");
    made->mix_levels = 1 + std::max(first.mix_levels, second.mix_levels);
    if (made->mix_levels > max_mix_levels) throw too_deep();
    const MaterialParams params(entity, context_, textures_);
    made->material = std::make_shared<shading::MixMaterial>(
        first.material, second.material, params.number("amount", 0.5f), static_cast<uint64_t>(index));
  }

  const Made& part(const MaterialEntity& entity, const std::string& name, int level) {
    const auto& named = context_.description.named_materials;
    const auto found = named.find(name);
    if (found == named.end())
      throw InputError(entity.loc, "no material is named \"" + name + "\"; expected a name given by MakeNamedMaterial");
    return get(found->second, level + 1);
  }

  const BuildContext& context_;
  const TextureLibrary& textures_;
  PluginFactory plugins_;
  std::vector<Made> made_;
};

}  // namespace

std::vector<MaterialPtr> make_materials(const BuildContext& context, const TextureLibrary& textures) {
  return MaterialBuilder(context, textures).build();
}

MaterialPtr make_material(const BuildContext& context, const TextureLibrary& textures, MaterialIndex index) {
  return MaterialBuilder(context, textures).build(index);
}

}  // namespace dapple::build
