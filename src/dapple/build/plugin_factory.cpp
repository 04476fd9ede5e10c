// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/plugin_factory.h"

#include <algorithm>
#include <filesystem>

#include "dapple/build/spectrum_params.h"
#include "dapple/build/texture_params.h"
#include "dapple/shading/diffuse_material.h"
#include "dapple/shading/guarded_light.h"
#include "dapple/shading/guarded_material.h"

namespace dapple::build {

using scenefile::MaterialEntity;
using shading::MaterialPtr;
using shading::ParamDecl;
using shading::ParamKind;
using shading::ParamValue;

namespace {

bool is_own_parameter(std::string_view name) {
  static constexpr std::string_view names[] = {
      "I",        "L",       "shader",          "scale",          "power",         "illuminance",
      "from",     "to",      "coneangle",       "conedeltaangle", "fov",           "filename",
      "twosided", "falloff", "falloffdistance", "decay",          "decaydistances"};
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

}  // namespace

MaterialPtr PluginFactory::make(const MaterialEntity& entity) {
  try {
    return load(entity);
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, entity.loc, "a surface of diffuse magenta", context_);
  }
  for (const scenefile::Param& p : entity.params.all()) entity.params.find(p.name);  // what they would mean is unknown
  return std::make_shared<shading::DiffuseMaterial>(pattern::Input<RGB>(RGB(1, 0, 1)), shading::SurfaceDetail());
}

// The plug-in that a parameter names, with the entity's values of what it declares.
shading::PluginLibraryPtr PluginFactory::library(const scenefile::Entity& entity, const char* parameter,
                                                 std::vector<ParamValue>* values) {
  const std::string path = context_.description.resolve(entity.params.get_string(parameter, ""));
  shading::PluginLibraryPtr& library = libraries_[path];
  if (!library) library = std::make_shared<const shading::PluginLibrary>(path, entity.params.find(parameter)->loc);
  for (const ParamDecl& declared : library->parameters()) values->push_back(value(declared, entity.params));
  return library;
}

MaterialPtr PluginFactory::load(const MaterialEntity& entity) {
  const std::string filename = entity.params.get_string("filename", "");
  if (filename.empty()) throw InputError(entity.loc, "this material needs a plug-in; expected \"string filename\"");
  std::vector<ParamValue> values;
  const shading::PluginLibraryPtr code = library(entity, "filename", &values);
  const std::string name = entity.loc.to_string() + ": shader \"" + code->table().name + "\" of " +
                           std::filesystem::path(filename).filename().string() +
                           (entity.name.empty() ? "" : ", material \"" + entity.name + "\"");
  return std::make_shared<shading::GuardedMaterial>(code, code->make(values, entity.loc), code->table().stages, name);
}

emitters::LightShaderPtr PluginFactory::make_light_shader(const scenefile::Entity& entity) {
  if (!entity.params.find("shader")) return nullptr;
  try {
    return load_light_shader(entity);
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, entity.loc, "the light without its shader", context_);
  }
  for (const scenefile::Param& p : entity.params.all()) entity.params.find(p.name);  // what they would mean is unknown
  return nullptr;
}

emitters::LightShaderPtr PluginFactory::load_light_shader(const scenefile::Entity& entity) {
  std::vector<ParamValue> values;
  const shading::PluginLibraryPtr code = library(entity, "shader", &values);
  for (const ParamDecl& declared : code->parameters())
    if (is_own_parameter(declared.name))
      throw InputError(entity.params.find("shader")->loc,
                       "the shader plug-in declares \"" + std::string(declared.name) +
                           "\", which is a parameter of lights; expected another name");
  const std::string name = entity.loc.to_string() + ": light shader \"" + code->table().name + "\" of " +
                           std::filesystem::path(entity.params.get_string("shader", "")).filename().string();
  return std::make_shared<shading::GuardedLight>(code, code->make_light(values, entity.loc), name);
}

ParamValue PluginFactory::value(const ParamDecl& declared, const scenefile::ParamSet& params) const {
  const char* name = declared.name;
  const RGB color(declared.fallback[0], declared.fallback[1], declared.fallback[2]);
  ParamValue v;
  switch (declared.kind) {
    case ParamKind::boolean:
      v.integer = params.get_bool(name, declared.fallback[0] != 0);
      break;
    case ParamKind::integer:
      v.integer = params.get_int(name, int32_t(declared.fallback[0]));
      break;
    case ParamKind::number:
      v.number = params.get_float(name, declared.fallback[0]);
      break;
    case ParamKind::color: {
      const scenefile::Param* p = params.find(name);
      v.color = p ? unbounded_rgb(*p, context_) : color;
      break;
    }
    case ParamKind::text:
      v.text = params.get_string(name, declared.text_fallback);
      break;
    case ParamKind::float_texture:
      v.float_texture = textures_.float_texture(params, name, declared.fallback[0]);
      break;
    case ParamKind::color_texture:
      v.color_texture = textures_.unbounded_texture(params, name, color);
      break;
    case ParamKind::reflectance:
      v.color_texture = textures_.reflectance_texture(params, name, color);
      break;
  }
  return v;
}

}  // namespace dapple::build
