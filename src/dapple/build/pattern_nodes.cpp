// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/pattern_nodes.h"

#include "dapple/build/spectrum_params.h"
#include "dapple/pattern/pattern_ramp.h"

namespace dapple::build {

using namespace pattern;

namespace {

/// f of patterns, channel by channel for colours.
template <class F, class... Floats>
PatternFloat each(F f, PatternFloat first, Floats... more) {
  return f(first, more...);
}
using expression::each;

template <class T, PatternOp op>
Pattern<T> unary(const TextureInputs& in) {
  return each([](PatternFloat a) { return apply(op, a); }, in.operand<T>("in", 0));
}

template <class T>
Pattern<T> fraction(const TextureInputs& in) {
  return each([](PatternFloat a) { return fract(a); }, in.operand<T>("in", 0));
}

/// neutral: the default of both operands.
template <class T, PatternOp op, int neutral>
Pattern<T> binary(const TextureInputs& in) {
  return each([](PatternFloat a, PatternFloat b) { return apply(op, a, b); }, in.operand<T>("in1", neutral),
              in.operand<T>("in2", neutral));
}

template <class T>
Pattern<T> inverted(const TextureInputs& in) {
  return each([](PatternFloat amount, PatternFloat a) { return amount - a; }, in.operand<T>("amount", 1),
              in.operand<T>("in", 0));
}

template <class T>
Pattern<T> clamped(const TextureInputs& in) {
  return each([](PatternFloat a, PatternFloat low, PatternFloat high) { return clamp(a, low, high); },
              in.operand<T>("in", 0), in.operand<T>("low", 0), in.operand<T>("high", 1));
}

template <class T>
Pattern<T> smooth_stepped(const TextureInputs& in) {
  return each([](PatternFloat low, PatternFloat high, PatternFloat a) { return smoothstep(low, high, a); },
              in.operand<T>("low", 0), in.operand<T>("high", 1), in.operand<T>("in", 0));
}

template <class T>
Pattern<T> remapped(const TextureInputs& in) {
  return each([](PatternFloat a, PatternFloat in_low, PatternFloat in_high, PatternFloat out_low,
                 PatternFloat out_high) { return out_low + (a - in_low) / (in_high - in_low) * (out_high - out_low); },
              in.operand<T>("in", 0), in.operand<T>("inlow", 0), in.operand<T>("inhigh", 1), in.operand<T>("outlow", 0),
              in.operand<T>("outhigh", 1));
}

template <class T>
Pattern<T> contrast(const TextureInputs& in) {
  return each([](PatternFloat a, PatternFloat amount, PatternFloat pivot) { return (a - pivot) * amount + pivot; },
              in.operand<T>("in", 0), in.operand<T>("amount", 1), in.operand<T>("pivot", 0.5f));
}

template <class T>
Pattern<T> chosen(const TextureInputs& in, PatternFloat condition) {
  return each([&](PatternFloat a, PatternFloat b) { return select(condition, a, b); }, in.operand<T>("in1", 0),
              in.operand<T>("in2", 0));
}

template <class T>
Pattern<T> selected(const TextureInputs& in) {
  return chosen<T>(in, less(0.5f, in.number("which", 0)));
}

template <class T>
Pattern<T> if_greater(const TextureInputs& in) {
  return chosen<T>(in, less(in.number("value2", 0), in.number("value1", 1)));
}

/// Values of a ramp's knots, one after another.
template <class T>
std::vector<float> ramp_values(const TextureInputs& in) {
  if constexpr (std::is_same_v<T, float>) {
    const auto values = in.params.get_floats("values");
    return {values.begin(), values.end()};
  } else {
    const scenefile::Param* p = in.params.find("values");
    if (!p) return {};
    if (p->type != scenefile::ParamType::rgb || p->numbers.size() % 3 != 0)
      throw InputError(p->loc, "\"values\" of a spectrum ramp: expected rgb, three numbers for each position");
    std::vector<float> values;
    scenefile::Param one = *p;
    for (size_t i = 0; i < p->numbers.size(); i += 3) {
      one.numbers.assign(p->numbers.begin() + static_cast<std::ptrdiff_t>(i),
                         p->numbers.begin() + static_cast<std::ptrdiff_t>(i) + 3);
      const RGB c = unbounded_rgb(one, in.context);
      values.insert(values.end(), {c.r, c.g, c.b});
    }
    return values;
  }
}

template <class T>
Pattern<T> ramped(const TextureInputs& in) {
  constexpr size_t channels = std::is_same_v<T, float> ? 1 : 3;
  constexpr size_t most_knots = 4096;
  const auto given = in.params.get_floats("positions");
  std::vector<float> positions(given.begin(), given.end()), values = ramp_values<T>(in);
  if (positions.empty() && values.empty()) {
    positions = {0, 1};
    values.assign(channels, 0);
    values.resize(2 * channels, 1);
  }
  if (positions.empty() || positions.size() > most_knots || values.size() != positions.size() * channels)
    in.fail("a ramp needs as many \"values\" as \"positions\", 1 to " + std::to_string(most_knots) + "; there are " +
            std::to_string(values.size() / channels) + " and " + std::to_string(positions.size()));
  if (!std::is_sorted(positions.begin(), positions.end())) in.fail("\"positions\" of a ramp do not ascend");
  const auto interpolation = static_cast<RampInterpolation>(
      in.params.get_choice("interpolation", {"constant", "linear", "smooth", "spline"}, 1));
  const PatternRamp made(positions, values, static_cast<int>(channels), interpolation);
  const PatternFloat x = in.number("in", 0);
  if constexpr (channels == 1)
    return made(x);
  else
    return made.color(x);
}

PatternFloat coordinate(const TextureInputs& in) {
  const int which = in.params.get_choice("which", {"u", "v", "x", "y", "z", "nx", "ny", "nz"}, 0);
  const Transform space = in.params.get_choice("space", {"texture", "world"}, 0) == 1
                              ? with_base(Transform(), in.context.origins.scene)
                              : in.world_to_texture;
  if (which == 0) return pattern_input(in.graph, PatternInput::u);
  if (which == 1) return pattern_input(in.graph, PatternInput::v);
  if (which >= 5) {
    const PatternVector n = shading_normal(in.graph, space);
    return which == 5 ? n.x : which == 6 ? n.y : n.z;
  }
  const PatternVector p = solid_mapping(in.graph, space).p;
  return which == 2 ? p.x : which == 3 ? p.y : p.z;
}

PatternFloat brightness(const TextureInputs& in) {
  return luminance(in.color("in", 0));
}

PatternFloat channel(const TextureInputs& in) {
  const PatternColor c = in.color("in", 0);
  const int index = in.params.get_int("index", 0);
  if (index < 0 || index > 2) in.fail("\"index\" is " + std::to_string(index) + "; expected 0, 1 or 2");
  return index == 0 ? c.r : index == 1 ? c.g : c.b;
}

PatternColor combined(const TextureInputs& in) {
  return {in.number("in1", 0), in.number("in2", 0), in.number("in3", 0)};
}

PatternColor hsv(const TextureInputs& in) {
  const PatternColor c = rgb_to_hsv(in.color("in", 0));
  return hsv_to_rgb({c.r + in.number("hue", 0), c.g * in.number("saturation", 1), c.b * in.number("value", 1)});
}

PatternColor saturated(const TextureInputs& in) {
  const PatternColor c = in.color("in", 0);
  return mix(grey(luminance(c)), c, in.number("amount", 1));
}

/// What the noises have in common: where, and pivot + amplitude noise.
PatternPoint3 noise_point(const TextureInputs& in) {
  return in.point3() * in.params.get_float("scale", 1);
}
PatternFloat amplified(const TextureInputs& in, PatternFloat noise) {
  return noise * in.number("amplitude", 1) + in.number("pivot", 0);
}

PatternFloat perlin_noise(const TextureInputs& in) {
  return amplified(in, perlin(noise_point(in)));
}
PatternFloat simplex_noise(const TextureInputs& in) {
  return amplified(in, simplex(noise_point(in)));
}

PatternFloat cellular_noise(const TextureInputs& in) {
  const float jitter = in.params.get_float("jitter", 1);
  if (!(jitter >= 0 && jitter <= 1)) in.fail("\"jitter\" is " + std::to_string(jitter) + "; expected 0 to 1");
  const PatternCells cells = worley(noise_point(in), jitter);
  const int output = in.params.get_choice("output", {"f1", "f2", "edge", "cell"}, 0);
  return amplified(in, output == 0 ? cells.f1 : output == 1 ? cells.f2 : output == 2 ? cells.f2 - cells.f1 : cells.id);
}

}  // namespace

template <class T>
std::vector<TextureType<T>> pattern_nodes() {
  using enum PatternOp;
  std::vector<TextureType<T>> types{{"add", binary<T, add, 0>},
                                    {"subtract", binary<T, subtract, 0>},
                                    {"multiply", binary<T, multiply, 1>},
                                    {"divide", binary<T, divide, 1>},
                                    {"modulo", binary<T, modulo, 1>},
                                    {"power", binary<T, power, 1>},
                                    {"min", binary<T, minimum, 0>},
                                    {"max", binary<T, maximum, 0>},
                                    {"atan2", binary<T, PatternOp::atan2, 1>},
                                    {"abs", unary<T, absolute>},
                                    {"floor", unary<T, PatternOp::floor>},
                                    {"fract", fraction<T>},
                                    {"sqrt", unary<T, PatternOp::sqrt>},
                                    {"exp", unary<T, PatternOp::exp>},
                                    {"ln", unary<T, PatternOp::log>},
                                    {"sin", unary<T, PatternOp::sin>},
                                    {"cos", unary<T, PatternOp::cos>},
                                    {"invert", inverted<T>},
                                    {"clamp", clamped<T>},
                                    {"smoothstep", smooth_stepped<T>},
                                    {"remap", remapped<T>},
                                    {"contrast", contrast<T>},
                                    {"select", selected<T>},
                                    {"ifgreater", if_greater<T>},
                                    {"ramp", ramped<T>}};
  if constexpr (std::is_same_v<T, float>)
    types.insert(types.end(), {{"coordinate", coordinate},
                               {"luminance", brightness},
                               {"extract", channel},
                               {"perlin", perlin_noise},
                               {"simplex", simplex_noise},
                               {"worley", cellular_noise},
                               {"cellular", cellular_noise}});
  else
    types.insert(types.end(), {{"combine3", combined}, {"hsv", hsv}, {"saturate", saturated}});
  return types;
}

template std::vector<TextureType<float>> pattern_nodes<float>();
template std::vector<TextureType<RGB>> pattern_nodes<RGB>();

}  // namespace dapple::build
