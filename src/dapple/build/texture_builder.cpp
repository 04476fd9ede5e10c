// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_builder.h"

#include "dapple/build/coverage.h"
#include "dapple/build/pattern_nodes.h"
#include "dapple/build/texture_params.h"

namespace dapple::build {

using namespace pattern;

namespace {

template <class T>
Pattern<T> constant(const TextureInputs& in) {
  return pattern_number(in.graph, in.value<T>("value", 1));
}

template <class T>
Pattern<T> scale(const TextureInputs& in) {
  return in.texture<T>("tex", 1) * in.number("scale", 1);
}

template <class T>
Pattern<T> mixed(const TextureInputs& in) {
  return mix(in.texture<T>("tex1", 0), in.texture<T>("tex2", 1), in.number("amount", 0.5f));
}

template <class T>
Pattern<T> direction_mix(const TextureInputs& in) {
  const V3f direction = in.entity.transform.start.vector(in.params.get_vector3("dir", {0, 1, 0}));
  if (!(length2(direction) > 0) || !is_finite(direction)) in.fail("\"dir\" of a directionmix texture has no direction");
  return mix(in.texture<T>("tex2", 1), in.texture<T>("tex1", 0), facing(in.graph, normalize(direction)));
}

template <class T>
Pattern<T> bilinear(const TextureInputs& in) {
  return bilerp(in.point2(), in.value<T>("v00", 0), in.value<T>("v01", 1), in.value<T>("v10", 0),
                in.value<T>("v11", 1));
}

template <class T>
Pattern<T> image_map(const TextureInputs& in) {
  const PatternPoint2 point = in.point2();
  const ImageParams image = image_params(in.entity, in.context);
  constexpr bool scalar = std::is_same_v<T, float>;
  try {
    const auto use = scalar ? image::TextureUse::scalar : image::TextureUse::color;
    const image::TextureHandle handle = in.context.texture_system.open(
        image.path, image.encoding, use, image.loc,
        scalar ? image::TextureWeight{} : texture_weight(in.entity, image, in.library.coverage()));
    warn_of_not_numbers(handle.not_numbers(), image.path, image.loc, in.context);
    if constexpr (scalar) {
      return image_float(point, handle, image.options);
    } else {
      const PatternColor color = image_color(point, handle, image.options);
      return in.role == TextureRole::reflectance ? each([](PatternFloat v) { return clamp(v, 0, 1); }, color)
                                                 : color;  // as pbrt-v4: mixes see no reflectance above 1
    }
  } catch (const InputError& e) {
    if (!in.context.keep_going) throw;
    warn_of_stand_in(e, image.loc, scalar ? "1" : "a magenta and black checker", in.context);
  }
  if constexpr (scalar)
    return pattern_number(in.graph, 1);
  else
    return missing_image(in.graph);
}

template <class T>
Pattern<T> checkers(const TextureInputs& in) {
  const int dimension = in.params.get_int("dimension", 2);
  if (dimension != 2 && dimension != 3)
    in.fail("a checkerboard has dimension 2 or 3, not " + std::to_string(dimension));
  const PatternFloat weight = dimension == 3 ? checkerboard(in.point3()) : checkerboard(in.point2());
  return mix(in.texture<T>("tex1", 1), in.texture<T>("tex2", 0), weight);
}

template <class T>
Pattern<T> dotted(const TextureInputs& in) {
  return mix(in.texture<T>("outside", 0), in.texture<T>("inside", 1), dots(in.point2()));
}

template <class T>
Pattern<T> ptex(const TextureInputs& in) {
  for (const char* name : {"filename", "encoding", "scale"}) in.params.find(name);
  in.context.diagnostics.unsupported(in.entity.loc, "texture \"ptex\"", "a constant of 0.5");
  return pattern_number(in.graph, T(0.5f));
}

PatternFloat fractal(const TextureInputs& in) {
  return fbm(in.point3(), in.octaves(), in.params.get_float("roughness", 0.5f));
}

PatternFloat turbulent(const TextureInputs& in) {
  return turbulence(in.point3(), in.octaves(), in.params.get_float("roughness", 0.5f));
}

PatternFloat waves(const TextureInputs& in) {
  return windy(in.point3());
}

PatternColor marbled(const TextureInputs& in) {
  return marble(in.point3(), in.octaves(), in.params.get_float("roughness", 0.5f), in.params.get_float("scale", 1),
                in.params.get_float("variation", 0.2f));
}

template <class T>
std::vector<TextureType<T>> pbrt_types() {
  return {{"constant", constant<T>},          {"scale", scale<T>},     {"mix", mixed<T>},
          {"directionmix", direction_mix<T>}, {"bilerp", bilinear<T>}, {"imagemap", image_map<T>},
          {"checkerboard", checkers<T>},      {"dots", dotted<T>},     {"ptex", ptex<T>}};
}

template <class T>
Pattern<T> make(const TextureInputs& in, const std::vector<TextureType<T>>& types) {
  std::vector<std::string_view> names;
  for (const auto& [name, maker] : types) {
    if (name == in.entity.type) return maker(in);
    names.push_back(name);
  }
  in.fail("unknown type \"" + in.entity.type + "\" of " + (std::is_same_v<T, float> ? "float" : "spectrum") +
          " texture \"" + in.entity.name + "\"; " + one_of(names));
}

template <class T>
std::vector<TextureType<T>> all_types(std::initializer_list<TextureType<T>> own) {
  std::vector<TextureType<T>> types = pbrt_types<T>();
  types.insert(types.end(), own);
  const std::vector<TextureType<T>> nodes = pattern_nodes<T>();
  types.insert(types.end(), nodes.begin(), nodes.end());
  return types;
}

}  // namespace

PatternFloat make_float_pattern(const TextureInputs& in) {
  static const auto types =
      all_types<float>({{"fbm", fractal}, {"wrinkled", turbulent}, {"turbulence", turbulent}, {"windy", waves}});
  return make<float>(in, types);
}

PatternColor make_color_pattern(const TextureInputs& in) {
  static const auto types = all_types<RGB>({{"marble", marbled}});
  return make<RGB>(in, types);
}

}  // namespace dapple::build
