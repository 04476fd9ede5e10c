// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "dapple/emitters/light_shader.h"
#include "dapple/pattern/input.h"
#include "dapple/shading/material.h"

// What the author of a shader plug-in includes (docs/guide/shaders.md). A plug-in is one class and one line:
//
//   class Toon final : public dapple::shading::PluginMaterial {
//    public:
//     static constexpr ParamDecl parameters[] = {ParamDecl::number("steps", 4, "number of tones")};
//     explicit Toon(const PluginParams& p) : steps_(p.number("steps")) {}
//     void postlighting(const PostLighting& in) const override;
//     ...
//   };
//   DAPPLE_SHADER_PLUGIN(Toon, "toon")
//
// compiled to a shared object (CMake: dapple_add_plugin) and named by a scene: Material "plugin" "string filename"
// "libtoon.so". A light shader derives from dapple::shading::PluginLight, ends with DAPPLE_LIGHT_PLUGIN, and is named
// by "string shader" of a light.
//
// The rule of binary compatibility: C++ types cross the border, so a plug-in works with the Dapple whose headers it was
// compiled against, and a C++ library of the same layout (libstdc++). PluginTable carries a version and a hash of the
// layouts and virtual functions that cross; a plug-in in which either differs is refused, and has to be compiled again.
// A plug-in contains its own copy of what it calls in Dapple's libraries, which keep no state; it needs no symbol of
// the program that loads it.

namespace dapple::shading {

// What plug-ins name of other libraries.
using emitters::LightPoints;
using emitters::LightShader;
using pattern::FloatTexture;
using pattern::FloatTexturePtr;
using pattern::Input;
using pattern::InputValues;
using pattern::RgbTexture;
using pattern::RgbTexturePtr;
using pattern::ShadingPoints;
using namespace scattering;

/// To be raised whenever the meaning of what crosses the border changes; plugin_layout() sees other changes by itself.
inline constexpr uint32_t plugin_abi_version = 3;
inline constexpr uint64_t plugin_magic = 0x6e69676c50706144;  // "DapPlgin"

/// How a parameter is written in a scene: bool, integer, float, rgb (or spectrum), string, float or texture, rgb or
/// texture. A reflectance is a colour texture with values in [0, 1].
enum class ParamKind : uint32_t { boolean, integer, number, color, text, float_texture, color_texture, reflectance };

/// Declares a parameter: its name in scenes, kind, default, and a line for users. Make it by the functions.
struct ParamDecl {
  const char* name;
  ParamKind kind;
  float fallback[3];
  const char* text_fallback;
  const char* description;

  static constexpr ParamDecl boolean(const char* name, bool fallback, const char* description) {
    return {name, ParamKind::boolean, {fallback ? 1.0f : 0.0f, 0, 0}, "", description};
  }
  /// fallback: below 2^24.
  static constexpr ParamDecl integer(const char* name, int fallback, const char* description) {
    return {name, ParamKind::integer, {float(fallback), 0, 0}, "", description};
  }
  static constexpr ParamDecl number(const char* name, float fallback, const char* description) {
    return {name, ParamKind::number, {fallback, 0, 0}, "", description};
  }
  static constexpr ParamDecl color(const char* name, RGB fallback, const char* description) {
    return {name, ParamKind::color, {fallback.r, fallback.g, fallback.b}, "", description};
  }
  static constexpr ParamDecl text(const char* name, const char* fallback, const char* description) {
    return {name, ParamKind::text, {0, 0, 0}, fallback, description};
  }
  static constexpr ParamDecl float_texture(const char* name, float fallback, const char* description) {
    return {name, ParamKind::float_texture, {fallback, 0, 0}, "", description};
  }
  static constexpr ParamDecl color_texture(const char* name, RGB fallback, const char* description) {
    return {name, ParamKind::color_texture, {fallback.r, fallback.g, fallback.b}, "", description};
  }
  static constexpr ParamDecl reflectance(const char* name, RGB fallback, const char* description) {
    return {name, ParamKind::reflectance, {fallback.r, fallback.g, fallback.b}, "", description};
  }
};

/// A parameter's value; the field that goes with its kind is set.
struct ParamValue {
  int32_t integer = 0;
  float number = 0;
  RGB color;
  std::string text;
  FloatTexturePtr float_texture;
  RgbTexturePtr color_texture;
};

/// The parameters of one material of a scene, as declared. Asking for what was not declared throws std::logic_error.
class PluginParams {
 public:
  PluginParams(std::span<const ParamDecl> declared, std::span<const ParamValue> values)
      : declared_(declared), values_(values) {}

  bool boolean(std::string_view name) const { return get(name, ParamKind::boolean).integer != 0; }
  int integer(std::string_view name) const { return get(name, ParamKind::integer).integer; }
  float number(std::string_view name) const { return get(name, ParamKind::number).number; }
  RGB color(std::string_view name) const { return get(name, ParamKind::color).color; }
  std::string text(std::string_view name) const { return get(name, ParamKind::text).text; }
  /// Evaluate it over a batch by InputValues (pattern/input.h).
  Input<float> float_texture(std::string_view name) const {
    return Input<float>(get(name, ParamKind::float_texture).float_texture);
  }
  Input<RGB> color_texture(std::string_view name) const {
    return Input<RGB>(get(name, ParamKind::color_texture).color_texture);
  }
  Input<RGB> reflectance(std::string_view name) const {
    return Input<RGB>(get(name, ParamKind::reflectance).color_texture);
  }

 private:
  const ParamValue& get(std::string_view name, ParamKind kind) const {
    for (size_t i = 0; i < declared_.size(); ++i)
      if (declared_[i].name == name && declared_[i].kind == kind) return values_[i];
    throw std::logic_error("parameter \"" + std::string(name) + "\" is not declared, or as another kind");
  }

  std::span<const ParamDecl> declared_;
  std::span<const ParamValue> values_;
};

/// The frame of point i: what prelighting gives a Bsdf that it does not bend.
inline Frame surface_frame(const ShadingPoints& points, int i) {
  return Frame(points.Ns[i], points.dPdu[i]);
}

/// Base of plug-ins: a grey diffuse surface until a stage is overridden. A derived class
/// - overrides, in public, the stages it has; no list of them is needed,
/// - may declare parameters: static constexpr ParamDecl parameters[],
/// - says by is_diffuse_to_rays() that its light can be cached, if its prelighting gives diffuse surfaces only, coated
/// or not, by has_colored_opacity() that the channels of its opacity stage differ, and by work() if its prelighting is
/// cheap: else it counts as dear, and is shaded once for many camera samples,
/// - has a constructor from const PluginParams&, which may throw: its message becomes that of the scene's error.
/// Stages must be pure functions of what they are given: they run on many threads at once, on batches that differ from
/// run to run.
class PluginMaterial : public Material {
 public:
  void prelighting(const ShadingPoints& points, Bsdf* out) const override {
    for (int i = 0; i < points.count; ++i) {
      out[i] = Bsdf::make_diffuse(RGB(0.5f));
      out[i].frame = surface_frame(points, i);
    }
  }
  bool needs_differentials() const override { return true; }
};

/// Base of light shaders. A derived class has emission, in public, which must be a pure function; parameters and a
/// constructor as those of PluginMaterial.
class PluginLight : public LightShader {};

/// What the entry point returns. magic, abi_version and layout keep their places for ever: the rest is read only if
/// these are right.
struct PluginTable {
  uint64_t magic;
  uint32_t abi_version;
  uint32_t instruction_sets;  ///< bits of plugin_instruction_sets()
  uint64_t layout;            ///< plugin_layout()
  const char* compiler;
  const char* name;
  const ParamDecl* parameters;
  uint64_t parameter_count;
  StageSet stages;
  Material* (*make)(const PluginParams&);           ///< by new; null where this is a light shader
  LightShader* (*make_light)(const PluginParams&);  ///< by new; null where this is a material
};

using PluginEntry = const PluginTable*();
inline constexpr const char* plugin_entry_name = "dapple_shader_plugin";

// Ends of the virtual tables: the place of this function is the number of those above it.
struct MaterialTableEnd : Material {
  virtual void end() = 0;
};
struct TextureTableEnd : FloatTexture {
  virtual void end() = 0;
};

struct LightTableEnd : LightShader {
  virtual void end() = 0;
};

/// Place of a virtual function in its table, as a pointer to it holds it (Itanium C++ ABI, 2.3).
template <class Function>
uint64_t virtual_place(Function function) {
  uint64_t place;
  static_assert(sizeof function >= sizeof place);
  std::memcpy(&place, &function, sizeof place);
  return place;
}

/// Hash of what must be alike on both sides of the border: sizes and offsets of types, and places of virtual functions.
inline uint64_t plugin_layout() {
  uint64_t h = 0xcbf29ce484222325;  // FNV-1a, by words
  for (const uint64_t v : {sizeof(void*),
                           sizeof(std::string),
                           sizeof(FloatTexturePtr),
                           sizeof(RGB),
                           sizeof(V3f),
                           sizeof(Frame),
                           sizeof(ShadingPoints),
                           size_t(ShadingPoints::capacity),
                           offsetof(ShadingPoints, dNdu),
                           offsetof(ShadingPoints, dPdx),
                           offsetof(ShadingPoints, u),
                           offsetof(ShadingPoints, key),
                           sizeof(Bsdf),
                           offsetof(Bsdf, frame),
                           offsetof(Bsdf, reflectance),
                           offsetof(Bsdf, eta),
                           offsetof(Bsdf, ior),
                           offsetof(Bsdf, alpha_x),
                           offsetof(Bsdf, coat_return),
                           sizeof(DiffuseLighting),
                           sizeof(SpecularLighting),
                           sizeof(PostLighting),
                           sizeof(Material),
                           size_t(stage_count),
                           sizeof(ParamDecl),
                           sizeof(ParamValue),
                           sizeof(PluginParams),
                           sizeof(PluginTable),
                           sizeof(std::optional<Bsdf>),
                           virtual_place(&Material::stages),
                           virtual_place(&Material::displacement),
                           virtual_place(&Material::opacity),
                           virtual_place(&Material::prelighting),
                           virtual_place(&Material::flat_prelighting),
                           virtual_place(&Material::diffuselighting),
                           virtual_place(&Material::specularlighting),
                           virtual_place(&Material::postlighting),
                           virtual_place(&Material::needs_differentials),
                           virtual_place(&Material::work),
                           virtual_place(&Material::constant),
                           virtual_place(&Material::is_diffuse_to_rays),
                           virtual_place(&Material::is_opaque_reflector),
                           virtual_place(&Material::is_interface),
                           virtual_place(&Material::has_colored_opacity),
                           virtual_place(&MaterialTableEnd::end),
                           virtual_place(&FloatTexture::evaluate),
                           virtual_place(&FloatTexture::constant),
                           virtual_place(&TextureTableEnd::end),
                           sizeof(LightPoints),
                           offsetof(LightPoints, local),
                           offsetof(LightPoints, v),
                           virtual_place(&LightShader::emission),
                           virtual_place(&LightTableEnd::end)})
    h = (h ^ v) * 0x100000001b3;
  return h;
}

/// What this translation unit was compiled for: bit 0 AVX, 1 AVX2, 2 FMA, 3 AVX-512F.
constexpr uint32_t plugin_instruction_sets() {
  uint32_t bits = 0;
#ifdef __AVX__
  bits |= 1;
#endif
#ifdef __AVX2__
  bits |= 2;
#endif
#ifdef __FMA__
  bits |= 4;
#endif
#ifdef __AVX512F__
  bits |= 8;
#endif
  return bits;
}

/// The stages that T, or a class between it and PluginMaterial, overrides: a pointer to an inherited member is of the
/// base's type.
template <class T>
constexpr StageSet plugin_stages() {
  const auto with = [](StageSet set, Stage stage, bool own) { return own ? set.with(stage) : set; };
  StageSet s{Stage::prelighting};
  s = with(s, Stage::displacement, !std::is_same_v<decltype(&T::displacement), decltype(&Material::displacement)>);
  s = with(s, Stage::opacity, !std::is_same_v<decltype(&T::opacity), decltype(&Material::opacity)>);
  s = with(s, Stage::diffuselighting,
           !std::is_same_v<decltype(&T::diffuselighting), decltype(&Material::diffuselighting)>);
  s = with(s, Stage::specularlighting,
           !std::is_same_v<decltype(&T::specularlighting), decltype(&Material::specularlighting)>);
  return with(s, Stage::postlighting, !std::is_same_v<decltype(&T::postlighting), decltype(&Material::postlighting)>);
}

template <class T>
Material* make_plugin(const PluginParams& params) {
  return new T(params);
}

template <class T>
LightShader* make_light_plugin(const PluginParams& params) {
  return new T(params);
}

template <class T>
PluginTable plugin_table(const char* name) {
  constexpr bool material = std::is_base_of_v<PluginMaterial, T>, light = std::is_base_of_v<PluginLight, T>;
  static_assert(material != light, "a plug-in derives from dapple::shading::PluginMaterial or PluginLight");
  PluginTable t{plugin_magic,
                plugin_abi_version,
                plugin_instruction_sets(),
                plugin_layout(),
                __VERSION__,
                name,
                nullptr,
                0,
                {},
                nullptr,
                nullptr};
  if constexpr (material) {
    t.stages = plugin_stages<T>();
    t.make = make_plugin<T>;
  } else {
    t.make_light = make_light_plugin<T>;
  }
  if constexpr (requires { T::parameters; }) {
    t.parameters = T::parameters;
    t.parameter_count = std::size(T::parameters);
  }
  return t;
}

}  // namespace dapple::shading

/// Once in a plug-in, outside any namespace. name: of the shader, for messages.
#define DAPPLE_SHADER_PLUGIN(Class, name)                                                                          \
  extern "C" __attribute__((visibility("default"))) const ::dapple::shading::PluginTable* dapple_shader_plugin() { \
    static const ::dapple::shading::PluginTable table = ::dapple::shading::plugin_table<Class>(name);              \
    return &table;                                                                                                 \
  }
/// The same for a light shader.
#define DAPPLE_LIGHT_PLUGIN(Class, name) DAPPLE_SHADER_PLUGIN(Class, name)
