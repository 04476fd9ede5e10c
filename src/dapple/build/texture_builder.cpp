// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_builder.h"

#include <span>
#include <utility>

#include "dapple/build/texture_params.h"
#include "dapple/shading/texture_image.h"
#include "dapple/shading/texture_pattern.h"

namespace dapple::build {

using namespace shading;

template <>
struct TextureBuilder::Inputs<float> {
  const TextureBuilder& builder;
  FloatTexturePtr texture(std::string_view name, float fallback) const {
    return builder.library_.float_texture(builder.params_, name, fallback);
  }
  float value(std::string_view name, float fallback) const { return builder.params_.get_float(name, fallback); }
};

template <>
struct TextureBuilder::Inputs<RGB> {
  const TextureBuilder& builder;
  TextureRole role;
  RgbTexturePtr texture(std::string_view name, float fallback) const {
    return role == TextureRole::reflectance ? builder.library_.reflectance_texture(builder.params_, name, RGB(fallback))
                                            : builder.library_.unbounded_texture(builder.params_, name, RGB(fallback));
  }
  RGB value(std::string_view name, float fallback) const {
    const scenefile::Param* p = builder.params_.find(name);
    return p ? spectrum_value(*p, role, builder.context_) : RGB(fallback);
  }
};

TextureBuilder::TextureBuilder(const BuildContext& context, const TextureLibrary& library,
                               const scenefile::TextureEntity& entity)
    : context_(context),
      library_(library),
      entity_(entity),
      params_(entity.params),
      world_to_texture_(entity.transform.start.inverse()) {
  if (!entity.transform.start.is_invertible())
    throw InputError(entity.loc, "the transform of texture \"" + entity.name + "\" has no inverse");
}

FloatTexturePtr TextureBuilder::make_float() const {
  return make<float>({*this});
}
RgbTexturePtr TextureBuilder::make_rgb(TextureRole role) const {
  return make<RGB>({*this, role});
}

template <class T>
TexturePtr<T> TextureBuilder::make(const Inputs<T>& in) const {
  std::vector<std::pair<std::string_view, Maker<T>>> makers{{"constant", &TextureBuilder::constant<T>},
                                                            {"scale", &TextureBuilder::scale<T>},
                                                            {"mix", &TextureBuilder::mix<T>},
                                                            {"directionmix", &TextureBuilder::direction_mix<T>},
                                                            {"bilerp", &TextureBuilder::bilerp<T>},
                                                            {"imagemap", &TextureBuilder::image_map<T>},
                                                            {"checkerboard", &TextureBuilder::checkerboard<T>},
                                                            {"dots", &TextureBuilder::dots<T>},
                                                            {"ptex", &TextureBuilder::ptex<T>}};
  if constexpr (std::is_same_v<T, float>) {
    makers.emplace_back("fbm", &TextureBuilder::fbm);
    makers.emplace_back("wrinkled", &TextureBuilder::wrinkled);
    makers.emplace_back("windy", &TextureBuilder::windy);
  } else {
    makers.emplace_back("marble", &TextureBuilder::marble);
  }
  std::vector<std::string_view> names;
  for (const auto& [name, maker] : makers) {
    if (name == entity_.type) return (this->*maker)(in);
    names.push_back(name);
  }
  throw InputError(entity_.loc, "unknown type \"" + entity_.type + "\" of " +
                                    (std::is_same_v<T, float> ? "float" : "spectrum") + " texture \"" + entity_.name +
                                    "\"; " + one_of(names));
}

TextureMapping2Ptr TextureBuilder::mapping2() const {
  const int kind = params_.get_choice("mapping", {"uv", "spherical", "cylindrical", "planar"}, 0);
  switch (kind) {
    case 1:
      return std::make_shared<SphericalMapping>(world_to_texture_);
    case 2:
      return std::make_shared<CylindricalMapping>(world_to_texture_);
    case 3:
      return std::make_shared<PlanarMapping>(world_to_texture_, params_.get_vector3("v1", {1, 0, 0}),
                                             params_.get_vector3("v2", {0, 1, 0}), params_.get_float("udelta", 0),
                                             params_.get_float("vdelta", 0));
    default:
      break;
  }
  return std::make_shared<UvMapping>(params_.get_float("uscale", 1), params_.get_float("vscale", 1),
                                     params_.get_float("udelta", 0), params_.get_float("vdelta", 0));
}

TextureMapping3 TextureBuilder::mapping3() const {
  return TextureMapping3(world_to_texture_);
}

int TextureBuilder::octaves() const {
  const int n = params_.get_int("octaves", 8);
  if (n < 0 || n > 64) throw InputError(entity_.loc, "\"octaves\" is " + std::to_string(n) + "; expected 0 to 64");
  return n;
}

template <class T>
TexturePtr<T> TextureBuilder::constant(const Inputs<T>& in) const {
  return make_constant<T>(in.value("value", 1));
}

template <class T>
TexturePtr<T> TextureBuilder::scale(const Inputs<T>& in) const {
  return make_scale<T>(in.texture("tex", 1), library_.float_texture(params_, "scale", 1));
}

template <class T>
TexturePtr<T> TextureBuilder::mix(const Inputs<T>& in) const {
  return make_mix<T>(in.texture("tex1", 0), in.texture("tex2", 1), library_.float_texture(params_, "amount", 0.5f));
}

template <class T>
TexturePtr<T> TextureBuilder::direction_mix(const Inputs<T>& in) const {
  const V3f direction = entity_.transform.start.vector(params_.get_vector3("dir", {0, 1, 0}));
  if (!(length2(direction) > 0) || !is_finite(direction))
    throw InputError(entity_.loc, "\"dir\" of a directionmix texture has no direction");
  return make_direction_mix<T>(in.texture("tex1", 0), in.texture("tex2", 1), normalize(direction));
}

template <class T>
TexturePtr<T> TextureBuilder::bilerp(const Inputs<T>& in) const {
  return std::make_shared<BilerpTexture<T>>(mapping2(), in.value("v00", 0), in.value("v01", 1), in.value("v10", 0),
                                            in.value("v11", 1));
}

template <class T>
TexturePtr<T> TextureBuilder::image_map(const Inputs<T>&) const {
  const TextureMapping2Ptr mapping = mapping2();
  const ImageParams image = image_params(entity_, context_);
  constexpr bool scalar = std::is_same_v<T, float>;
  try {
    const image::TextureHandle handle = context_.texture_system.open(
        image.path, image.encoding, scalar ? image::TextureUse::scalar : image::TextureUse::color, image.loc);
    const auto texture = std::make_shared<ImageTexture<T>>(mapping, handle, image.options);
    if (const auto c = texture->constant()) return make_constant<T>(*c);
    return texture;
  } catch (const InputError& e) {
    if (!context_.keep_going) throw;
    warn_of_stand_in(e, image.loc, scalar ? "1" : "a magenta and black checker", context_);
  }
  if constexpr (scalar)
    return make_constant<float>(1);
  else
    return missing_image_texture();
}

template <class T>
TexturePtr<T> TextureBuilder::checkerboard(const Inputs<T>& in) const {
  const int dimension = params_.get_int("dimension", 2);
  if (dimension != 2 && dimension != 3)
    throw InputError(entity_.loc, "a checkerboard has dimension 2 or 3, not " + std::to_string(dimension));
  TexturePtr<T> a = in.texture("tex1", 1), b = in.texture("tex2", 0);
  if (dimension == 3) return std::make_shared<CheckerboardTexture<T>>(mapping3(), std::move(a), std::move(b));
  return std::make_shared<CheckerboardTexture<T>>(mapping2(), std::move(a), std::move(b));
}

template <class T>
TexturePtr<T> TextureBuilder::dots(const Inputs<T>& in) const {
  return std::make_shared<DotsTexture<T>>(mapping2(), in.texture("inside", 1), in.texture("outside", 0));
}

template <class T>
TexturePtr<T> TextureBuilder::ptex(const Inputs<T>&) const {
  for (const char* name : {"filename", "encoding", "scale"}) params_.find(name);
  context_.diagnostics.unsupported(entity_.loc, "texture \"ptex\"", "a constant of 0.5");
  return make_constant<T>(T(0.5f));
}

FloatTexturePtr TextureBuilder::fbm(const Inputs<float>&) const {
  return std::make_shared<FbmTexture>(mapping3(), octaves(), params_.get_float("roughness", 0.5f));
}

FloatTexturePtr TextureBuilder::wrinkled(const Inputs<float>&) const {
  return std::make_shared<WrinkledTexture>(mapping3(), octaves(), params_.get_float("roughness", 0.5f));
}

FloatTexturePtr TextureBuilder::windy(const Inputs<float>&) const {
  return std::make_shared<WindyTexture>(mapping3());
}

RgbTexturePtr TextureBuilder::marble(const Inputs<RGB>&) const {
  return std::make_shared<MarbleTexture>(mapping3(), octaves(), params_.get_float("roughness", 0.5f),
                                         params_.get_float("scale", 1), params_.get_float("variation", 0.2f));
}

}  // namespace dapple::build
