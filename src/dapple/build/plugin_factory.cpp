// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/plugin_factory.h"

#include <filesystem>

#include "dapple/build/spectrum_params.h"
#include "dapple/build/texture_params.h"
#include "dapple/shading/diffuse_material.h"
#include "dapple/shading/guarded_material.h"

namespace dapple::build {

using scenefile::MaterialEntity;
using shading::MaterialPtr;
using shading::ParamDecl;
using shading::ParamKind;
using shading::ParamValue;

MaterialPtr PluginFactory::make(const MaterialEntity& entity) {
  try {
    return load(entity);
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, entity.loc, "a surface of diffuse magenta", context_);
  }
  for (const scenefile::Param& p : entity.params.all()) entity.params.find(p.name);  // what they would mean is unknown
  return std::make_shared<shading::DiffuseMaterial>(shading::Input<RGB>(RGB(1, 0, 1)), shading::SurfaceDetail());
}

MaterialPtr PluginFactory::load(const MaterialEntity& entity) {
  const std::string filename = entity.params.get_string("filename", "");
  if (filename.empty()) throw InputError(entity.loc, "this material needs a plug-in; expected \"string filename\"");
  const std::string path = context_.description.resolve(filename);
  shading::PluginLibraryPtr& library = libraries_[path];
  if (!library) library = std::make_shared<const shading::PluginLibrary>(path, entity.params.find("filename")->loc);
  std::vector<ParamValue> values;
  for (const ParamDecl& declared : library->parameters()) values.push_back(value(declared, entity.params));
  const std::string name = entity.loc.to_string() + ": shader \"" + library->table().name + "\" of " +
                           std::filesystem::path(filename).filename().string() +
                           (entity.name.empty() ? "" : ", material \"" + entity.name + "\"");
  return std::make_shared<shading::GuardedMaterial>(library, library->make(values, entity.loc), library->table().stages,
                                                    name);
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
