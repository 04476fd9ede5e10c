// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_factory.h"

#include "dapple/build/texture_builder.h"
#include "dapple/build/texture_params.h"
#include "dapple/image/texture_system.h"

namespace dapple::build {

using scenefile::Param;
using scenefile::ParamSet;
using scenefile::ParamType;
using shading::FloatTexturePtr;
using shading::make_constant;
using shading::RgbTexturePtr;

TextureLibrary::TextureLibrary(const BuildContext& context) : context_(context) {
  for (const scenefile::TextureEntity& entity : context.description.textures) {
    const TextureBuilder builder(context, *this, entity);
    if (entity.is_spectrum) {
      unbounded_textures_[entity.name] = builder.make_rgb(TextureRole::unbounded);
    } else {
      float_textures_[entity.name] = builder.make_float();
    }
    entity.params.report_unused("texture \"" + entity.type + "\"", context.diagnostics);
  }
}

void TextureLibrary::fail_unknown(const Param& param, bool spectrum) const {
  const std::string name = param.strings.empty() ? std::string() : param.strings.front();
  const std::string what = std::string(spectrum ? "spectrum" : "float") + " texture \"" + name + "\"";
  const auto& same = spectrum ? context_.description.spectrum_textures : context_.description.float_textures;
  const auto& other = spectrum ? context_.description.float_textures : context_.description.spectrum_textures;
  if (const auto later = same.find(name); later != same.end())
    throw InputError(param.loc, what + " is used before its definition at " +
                                    context_.description.textures[static_cast<size_t>(later->second)].loc.to_string());
  if (other.contains(name))
    throw InputError(param.loc, "\"" + name + "\" is a " + (spectrum ? "float" : "spectrum") +
                                    " texture; parameter \"" + param.name + "\" expects a " +
                                    (spectrum ? "spectrum" : "float") + " texture");
  throw InputError(param.loc, what + " is not defined");
}

FloatTexturePtr TextureLibrary::optional_float_texture(const ParamSet& params, std::string_view name) const {
  const Param* p = params.find(name);
  if (!p) return nullptr;
  if (p->type == ParamType::real) return make_constant(params.get_float(name, 0));
  if (p->type != ParamType::texture)
    throw InputError(p->loc, "parameter \"" + p->name + "\" has type \"" + std::string(name_of(p->type)) +
                                 "\"; expected float or texture");
  const auto at = p->strings.size() == 1 ? float_textures_.find(p->strings[0]) : float_textures_.end();
  if (at == float_textures_.end()) fail_unknown(*p, false);
  return at->second;
}

FloatTexturePtr TextureLibrary::float_texture(const ParamSet& params, std::string_view name, float fallback) const {
  FloatTexturePtr t = optional_float_texture(params, name);
  return t ? t : make_constant(fallback);
}

RgbTexturePtr TextureLibrary::find_rgb(const ParamSet& params, std::string_view name, TextureRole role) const {
  const Param* p = params.find(name);
  if (!p) return nullptr;
  if (p->type != ParamType::texture) return make_constant(spectrum_value(*p, role, context_));
  return named_rgb(*p, role);
}

RgbTexturePtr TextureLibrary::named_rgb(const Param& param, TextureRole role) const {
  const auto at = param.strings.size() == 1 ? unbounded_textures_.find(param.strings[0]) : unbounded_textures_.end();
  if (at == unbounded_textures_.end()) fail_unknown(param, true);
  if (role == TextureRole::unbounded) return at->second;
  const std::lock_guard lock(mutex_);
  RgbTexturePtr& texture = reflectance_textures_[at->first];
  if (!texture) {
    const int32_t index = context_.description.spectrum_textures.at(at->first);
    texture = TextureBuilder(context_, *this, context_.description.textures[static_cast<size_t>(index)]).make_rgb(role);
  }
  return texture;
}

RgbTexturePtr TextureLibrary::optional_reflectance_texture(const ParamSet& params, std::string_view name) const {
  return find_rgb(params, name, TextureRole::reflectance);
}

RgbTexturePtr TextureLibrary::optional_unbounded_texture(const ParamSet& params, std::string_view name) const {
  return find_rgb(params, name, TextureRole::unbounded);
}

RgbTexturePtr TextureLibrary::reflectance_texture(const ParamSet& params, std::string_view name,
                                                  const RGB& fallback) const {
  RgbTexturePtr t = optional_reflectance_texture(params, name);
  return t ? t : make_constant(fallback);
}

RgbTexturePtr TextureLibrary::unbounded_texture(const ParamSet& params, std::string_view name,
                                                const RGB& fallback) const {
  RgbTexturePtr t = optional_unbounded_texture(params, name);
  return t ? t : make_constant(fallback);
}

RgbTexturePtr TextureLibrary::normal_map(const std::string& filename, const FileLoc& loc) const {
  try {
    const image::TextureHandle handle = context_.texture_system.open(
        context_.description.resolve(filename), image::Encoding::linear(), image::TextureUse::color, loc);
    return std::make_shared<shading::ImageTexture<RGB>>(std::make_shared<shading::UvMapping>(), handle,
                                                        shading::ImageTextureOptions());
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, loc, "a flat normal map", context_);
  }
  return make_constant(RGB(0.5f, 0.5f, 1));
}

image::Image TextureLibrary::light_image(const std::string& filename, const FileLoc& loc,
                                         image::Encoding encoding) const {
  try {
    return image::read_image(context_.description.resolve(filename), loc, encoding);
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, loc, "a magenta and black checker", context_);
  }
  image::Image checker(16, 16, 3);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      if ((x + y) % 2 == 0) checker.pixel(x, y)[0] = checker.pixel(x, y)[2] = 1;
  return checker;
}

}  // namespace dapple::build
