// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_factory.h"

#include <algorithm>
#include <cmath>

#include "dapple/build/texture_builder.h"
#include "dapple/build/texture_params.h"
#include "dapple/image/texture_system.h"

namespace dapple::build {

using namespace pattern;
using scenefile::Param;
using scenefile::ParamSet;
using scenefile::ParamType;

TextureLibrary::TextureLibrary(const BuildContext& context) : context_(context) {
  for (const scenefile::TextureEntity& entity : context.description.textures) add(entity);
}

TextureLibrary::TextureLibrary(const BuildContext& context, const Coverage& coverage, const std::set<int32_t>& places)
    : context_(context), coverage_(&coverage) {
  for (const int32_t place : places) add(context.description.textures[static_cast<size_t>(place)]);
}

void TextureLibrary::add(const scenefile::TextureEntity& entity) {
  const TextureInputs in(context_, *this, entity, TextureRole::unbounded);
  if (entity.is_spectrum) {
    unbounded_[entity.name] = make_color_pattern(in);
  } else {
    float_patterns_[entity.name] = make_float_pattern(in);
  }
  entity.params.report_unused("texture \"" + entity.type + "\"", context_.diagnostics);
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

std::optional<PatternFloat> TextureLibrary::float_pattern(const ParamSet& params, std::string_view name) const {
  const Param* p = params.find(name);
  if (!p) return std::nullopt;
  if (p->type == ParamType::real) return pattern_number(graph_, params.get_float(name, 0));
  if (p->type != ParamType::texture)
    throw InputError(p->loc, "parameter \"" + p->name + "\" has type \"" + std::string(name_of(p->type)) +
                                 "\"; expected float or texture");
  const auto at = p->strings.size() == 1 ? float_patterns_.find(p->strings[0]) : float_patterns_.end();
  if (at == float_patterns_.end()) fail_unknown(*p, false);
  return at->second;
}

std::optional<PatternColor> TextureLibrary::color_pattern(const ParamSet& params, std::string_view name,
                                                          TextureRole role) const {
  const Param* p = params.find(name);
  if (!p) return std::nullopt;
  if (p->type != ParamType::texture) return pattern_number(graph_, spectrum_value(*p, role, context_));
  return named_color(*p, role);
}

bool TextureLibrary::is_float_only(const Param& param) const {
  return param.strings.size() == 1 && float_patterns_.contains(param.strings[0]) &&
         !unbounded_.contains(param.strings[0]);
}

PatternColor TextureLibrary::named_color(const Param& param, TextureRole role) const {
  const auto at = param.strings.size() == 1 ? unbounded_.find(param.strings[0]) : unbounded_.end();
  if (at == unbounded_.end()) fail_unknown(param, true);
  if (role == TextureRole::unbounded) return at->second;
  if (!reflectances_.contains(at->first)) make_reflectance(at->first);
  return reflectances_.at(at->first);
}

std::vector<std::string> TextureLibrary::spectrum_references(const scenefile::TextureEntity& entity) const {
  std::vector<std::string> names;
  for (const Param& p : entity.params.all())
    if (p.type == ParamType::texture && p.strings.size() == 1 && unbounded_.contains(p.strings[0]))
      names.push_back(p.strings[0]);
  return names;
}

/// With all it refers to, in the order of the file and without recursion: chains are long.
void TextureLibrary::make_reflectance(const std::string& name) const {
  const auto& places = context_.description.spectrum_textures;
  const auto entity = [&](int32_t place) -> const scenefile::TextureEntity& {
    return context_.description.textures[static_cast<size_t>(place)];
  };
  std::set<int32_t> needed{places.at(name)};
  std::vector<int32_t> open{places.at(name)};
  while (!open.empty()) {
    const int32_t user = open.back();
    open.pop_back();
    for (const std::string& reference : spectrum_references(entity(user)))
      if (const int32_t place = places.at(reference);
          place < user && !reflectances_.contains(reference) && needed.insert(place).second)
        open.push_back(place);
  }
  for (const int32_t place : needed)
    reflectances_[entity(place).name] =
        make_color_pattern(TextureInputs(context_, *this, entity(place), TextureRole::reflectance));
}

FloatTexturePtr TextureLibrary::compiled(const PatternFloat& pattern) const {
  FloatTexturePtr& texture = compiled_floats_[pattern.value()];
  if (!texture) texture = make_texture(pattern);
  return texture;
}

RgbTexturePtr TextureLibrary::compiled(const PatternColor& pattern) const {
  RgbTexturePtr& texture = compiled_colors_[{pattern.r.value(), pattern.g.value(), pattern.b.value()}];
  if (!texture) texture = make_texture(pattern);
  return texture;
}

FloatTexturePtr TextureLibrary::optional_float_texture(const ParamSet& params, std::string_view name) const {
  const std::lock_guard lock(mutex_);
  const auto pattern = float_pattern(params, name);
  return pattern ? compiled(*pattern) : nullptr;
}

FloatTexturePtr TextureLibrary::float_texture(const ParamSet& params, std::string_view name, float fallback) const {
  FloatTexturePtr t = optional_float_texture(params, name);
  return t ? t : make_constant(fallback);
}

RgbTexturePtr TextureLibrary::optional_rgb(const ParamSet& params, std::string_view name, TextureRole role) const {
  const std::lock_guard lock(mutex_);
  const auto pattern = color_pattern(params, name, role);
  return pattern ? compiled(*pattern) : nullptr;
}

RgbTexturePtr TextureLibrary::optional_reflectance_texture(const ParamSet& params, std::string_view name) const {
  return optional_rgb(params, name, TextureRole::reflectance);
}

RgbTexturePtr TextureLibrary::optional_unbounded_texture(const ParamSet& params, std::string_view name) const {
  return optional_rgb(params, name, TextureRole::unbounded);
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
    warn_of_not_numbers(handle.not_numbers(), filename, loc, context_);
    const std::lock_guard lock(mutex_);
    return compiled(image_color(uv_mapping(graph_), handle, {}));
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, loc, "a flat normal map", context_);
  }
  return make_constant(RGB(0.5f, 0.5f, 1));
}

image::Image TextureLibrary::light_image(const std::string& filename, const FileLoc& loc,
                                         image::Encoding encoding) const {
  try {
    const std::string path = context_.description.resolve(filename);
    image::Image image = image::read_image(path, loc, encoding);
    const auto count =
        std::count_if(image.pixels().begin(), image.pixels().end(), [](float v) { return std::isnan(v); });
    warn_of_not_numbers(size_t(count), path, loc, context_);
    return image;
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
