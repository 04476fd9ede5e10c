// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "dapple/build/texture_factory.h"
#include "dapple/emitters/light_shader.h"
#include "dapple/shading/plugin_library.h"

namespace dapple::build {

/// Materials of type "plugin" and shaders of lights: C++ shaders from shared objects (shading/plugin.h,
/// docs/guide/shaders.md). Each file is loaded once, and stays as long as a material of it.
class PluginFactory {
 public:
  PluginFactory(const BuildContext& context, const TextureLibrary& textures) : context_(context), textures_(textures) {}

  /// InputError where the plug-in cannot be used or refuses its parameters; with keep_going a warning, and a surface of
  /// diffuse magenta.
  shading::MaterialPtr make(const scenefile::MaterialEntity& entity);
  /// The light shader that "string shader" of a light names; null where there is none, and, with keep_going, after a
  /// warning where it cannot be used.
  emitters::LightShaderPtr make_light_shader(const scenefile::Entity& entity);

 private:
  shading::MaterialPtr load(const scenefile::MaterialEntity& entity);
  emitters::LightShaderPtr load_light_shader(const scenefile::Entity& entity);
  shading::PluginLibraryPtr library(const scenefile::Entity& entity, const char* parameter,
                                    std::vector<shading::ParamValue>* values);
  shading::ParamValue value(const shading::ParamDecl& declared, const scenefile::ParamSet& params) const;

  const BuildContext& context_;
  const TextureLibrary& textures_;
  std::map<std::string, shading::PluginLibraryPtr> libraries_;
};

}  // namespace dapple::build
