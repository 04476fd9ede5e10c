// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_inputs.h"

#include "dapple/build/spectrum_params.h"
#include "dapple/build/texture_params.h"

namespace dapple::build {

using namespace pattern;
using scenefile::Param;
using scenefile::ParamType;

TextureInputs::TextureInputs(const BuildContext& c, const TextureLibrary& l, const scenefile::TextureEntity& e,
                             TextureRole r)
    : context(c),
      library(l),
      entity(e),
      params(e.params),
      role(r),
      graph(l.graph()),
      world_to_texture(with_base(e.transform.start.inverse(), c.origins.scene)) {
  if (!e.transform.start.is_invertible()) fail("the transform of texture \"" + e.name + "\" has no inverse");
}

template <>
PatternFloat TextureInputs::texture<float>(std::string_view name, float fallback) const {
  return library.float_pattern(params, name).value_or(pattern_number(graph, fallback));
}
template <>
PatternColor TextureInputs::texture<RGB>(std::string_view name, float fallback) const {
  return library.color_pattern(params, name, role).value_or(pattern_number(graph, RGB(fallback)));
}

template <>
float TextureInputs::value<float>(std::string_view name, float fallback) const {
  return params.get_float(name, fallback);
}
template <>
RGB TextureInputs::value<RGB>(std::string_view name, float fallback) const {
  const Param* p = params.find(name);
  return p ? spectrum_value(*p, role, context) : RGB(fallback);
}

PatternFloat TextureInputs::number(std::string_view name, float fallback) const {
  return texture<float>(name, fallback);
}

PatternColor TextureInputs::color(std::string_view name, float fallback) const {
  const Param* p = params.find(name);
  if (!p) return pattern_number(graph, RGB(fallback));
  if (p->type == ParamType::real) return pattern_number(graph, RGB(params.get_float(name, fallback)));
  if (p->type == ParamType::rgb) return pattern_number(graph, unbounded_rgb(*p, context));
  if (p->type == ParamType::texture && library.is_float_only(*p)) return grey(number(name, fallback));
  return texture<RGB>(name, fallback);
}

PatternPoint2 TextureInputs::point2() const {
  if (params.find("s") || params.find("t")) return computed_point(number("s", 0), number("t", 0));
  switch (params.get_choice("mapping", {"uv", "spherical", "cylindrical", "planar"}, 0)) {
    case 1:
      return spherical_mapping(graph, world_to_texture);
    case 2:
      return cylindrical_mapping(graph, world_to_texture);
    case 3:
      return planar_mapping(graph, world_to_texture, params.get_vector3("v1", {1, 0, 0}),
                            params.get_vector3("v2", {0, 1, 0}), params.get_float("udelta", 0),
                            params.get_float("vdelta", 0));
    default:
      return uv_mapping(graph, params.get_float("uscale", 1), params.get_float("vscale", 1),
                        params.get_float("udelta", 0), params.get_float("vdelta", 0));
  }
}

PatternPoint3 TextureInputs::point3() const {
  const PatternPoint3 solid = solid_mapping(graph, world_to_texture);
  const auto x = library.float_pattern(params, "x"), y = library.float_pattern(params, "y"),
             z = library.float_pattern(params, "z");
  if (!x && !y && !z) return solid;
  return computed_point({x.value_or(solid.p.x), y.value_or(solid.p.y), z.value_or(solid.p.z)});
}

int TextureInputs::octaves() const {
  const int n = params.get_int("octaves", 8);
  if (n < 0 || n > 64) fail("\"octaves\" is " + std::to_string(n) + "; expected 0 to 64");
  return n;
}

}  // namespace dapple::build
