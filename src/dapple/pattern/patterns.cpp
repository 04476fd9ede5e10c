// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/patterns.h"

#include "dapple/pattern/noise.h"
#include "dapple/pattern/pattern_ramp.h"

namespace dapple::pattern {

namespace {

using Value = PatternGraph::Value;

PatternColor color(PatternGraph& graph, const PatternGraph::Results& v) {
  return {{&graph, v[0]}, {&graph, v[1]}, {&graph, v[2]}};
}

PatternColor apply3(PatternOp op, const PatternVector& p, const std::vector<float>& parameters = {}) {
  const Value operands[]{p.x.value(), p.y.value(), p.z.value()};
  return color(p.x.graph(), p.x.graph().apply(op, operands, parameters, 3));
}

/// `value`, which its filter has robbed of this standard deviation.
PatternFloat with_spread(PatternFloat value, PatternFloat spread) {
  keep_as_width(&value.graph(), spread.value());
  value.graph().keep_spread(value.value(), spread.value());
  return value;
}

PatternFloat octaves_of(PatternOp op, const PatternPoint3& q, int octaves, float omega) {
  const Value operands[]{q.p.x.value(), q.p.y.value(), q.p.z.value(), squared_footprint(q).value()};
  PatternGraph& graph = q.p.x.graph();
  const std::vector<float> parameters{static_cast<float>(octaves), omega};
  const PatternFloat sum{&graph, graph.apply(op, operands, parameters)[0]};
  const PatternFloat left_out{&graph,
                              graph.apply(PatternOp::left_out_octaves, std::span(operands).last(1), parameters)[0]};
  const bool absolute = op == PatternOp::turbulence;
  return with_spread(sum, sqrt(left_out * (absolute ? lane::absolute_noise_variance : lane::noise_variance)));
}

/// 1 where the footprint resolves a wavelength of 1, 0 where it is half as long or longer.
PatternFloat resolved(const PatternPoint3& q) {
  const PatternFloat width2 = squared_footprint(q);
  const PatternFloat octaves = log(width2) * (-0.5f / std::numbers::ln2_v<float>)-1.0f;
  return select(less(0, width2), smoothstep(octaves.number(0.3f), octaves.number(0.7f), octaves), octaves.number(1));
}

/// The share of the standard deviation that a mean over the footprint takes, which keeps `weight` of what varies.
PatternFloat taken(PatternFloat weight) {
  return sqrt(1 - weight * weight);
}

constexpr float filter_width = 1.5f;  // footprints on either side

PatternFloat filtered_wave(PatternFloat x, PatternFloat dx, PatternFloat dy) {
  return square_wave(x, max(abs(dx), abs(dy)) * filter_width);
}

PatternFloat weight_of_sign(PatternFloat sign) {
  const PatternFloat weight = clamp(0.5f - sign * 0.5f, 0, 1);
  return with_spread(weight, sqrt(weight * (1 - weight)));
}

PatternFloat plane_noise(PatternFloat s, PatternFloat t) {
  return expression::apply(PatternOp::perlin, s, t, s.number(0.5f));
}

/// pbrt's marble colours over [0, 1]: Bezier segments over four of these colours at a time, each starting one later.
const PatternRamp& marble_ramp() {
  static const PatternRamp ramp = [] {
    constexpr RGB light{.58f, .58f, .6f};
    constexpr RGB colors[] = {light, light, light, {.5f, .5f, .5f}, {.6f, .59f, .58f}, light, light, {.2f, .2f, .33f},
                              light};
    std::vector<float> starts;
    std::vector<std::array<RGB, 4>> coefficients;
    for (int i = 0; i < 6; ++i) {
      const RGB* p = colors + i;
      starts.push_back(static_cast<float>(i));
      coefficients.push_back({1.5f * p[0], 4.5f * (p[1] - p[0]), 4.5f * (p[0] - 2 * p[1] + p[2]),
                              1.5f * (p[3] - p[0] + 3 * (p[1] - p[2]))});
    }
    return PatternRamp(starts, coefficients);
  }();
  return ramp;
}

PatternFloat finished(PatternFloat v, const ImageTextureOptions& options) {
  const PatternFloat scaled = v * options.scale;
  return options.invert ? max(1 - scaled, 0) : scaled;
}

PatternGraph::Results look_up(const PatternPoint2& q, const image::TextureHandle& image,
                              const ImageTextureOptions& options, int channels) {
  PatternGraph& graph = q.s.graph();
  // Beside a black border even an image of one colour is none.
  if (const auto c = image.constant(); c && options.sampling.wrap != image::Wrap::black) {
    if (channels == 1) return {graph.constant(((*c)[0] + (*c)[1] + (*c)[2]) / 3)};
    return {graph.constant((*c)[0]), graph.constant((*c)[1]), graph.constant((*c)[2])};
  }
  const std::array coordinates{q.s.value(),    q.t.value(),    q.dsdx.value(),
                               q.dtdx.value(), q.dsdy.value(), q.dtdy.value()};
  return graph.image({image, options.sampling}, coordinates, channels);
}

}  // namespace

PatternFloat perlin(const PatternPoint3& q) {
  return fbm(q, 1, 1);
}

PatternFloat simplex(const PatternPoint3& q) {
  const PatternFloat weight = resolved(q);
  return with_spread(expression::apply(PatternOp::simplex, q.p.x, q.p.y, q.p.z) * weight,
                     taken(weight) * std::sqrt(lane::simplex_variance));
}

PatternFloat fbm(const PatternPoint3& q, int octaves, float omega) {
  return octaves_of(PatternOp::fbm, q, octaves, omega);
}

PatternFloat turbulence(const PatternPoint3& q, int octaves, float omega) {
  return octaves_of(PatternOp::turbulence, q, octaves, omega);
}

PatternCells worley(const PatternPoint3& q, float jitter) {
  const PatternColor cells = apply3(PatternOp::worley, q.p, {jitter});
  // Means and standard deviations over space, fitted to averages over a million points
  // (tests/pattern/pattern_noise.cpp).
  const float mean_f1 = 0.480f + 0.041f * jitter * jitter, mean_f2 = 0.703f + 0.0155f * jitter;
  const float spread_f1 = 0.139f + 0.033f * jitter * jitter, spread_f2 = 0.075f + 0.068f * jitter;
  const PatternFloat weight = resolved(q), spread = taken(weight);
  const auto filtered = [&](PatternFloat v, float mean, float deviation) {
    return with_spread(mix(v.number(mean), v, weight), spread * deviation);
  };
  const PatternCells means{filtered(cells.r, mean_f1, spread_f1), filtered(cells.g, mean_f2, spread_f2),
                           filtered(cells.b, 0.5f, std::sqrt(1.0f / 12))};
  with_spread(means.f2 - means.f1,
              spread * (0.184f - 0.026f * jitter));  // borders of cells: the two are not independent
  return means;
}

PatternFloat windy(const PatternPoint3& q) {
  return abs(fbm(q * 0.1f, 3, 0.5f)) * fbm(q, 6, 0.5f);
}

PatternColor marble(const PatternPoint3& q, int octaves, float omega, float scale, float variation) {
  const PatternPoint3 p = q * scale;
  const PatternFloat layer = p.p.y + fbm(p, octaves, omega) * variation;
  return marble_ramp().color(clamp(0.5f + sin(layer) * 0.5f, 0, 1) * 6);
}

PatternFloat checkerboard(const PatternPoint2& q) {
  return weight_of_sign(filtered_wave(q.s, q.dsdx, q.dsdy) * filtered_wave(q.t, q.dtdx, q.dtdy));
}

PatternFloat checkerboard(const PatternPoint3& q) {
  return weight_of_sign(filtered_wave(q.p.x, q.dpdx.x, q.dpdy.x) * filtered_wave(q.p.y, q.dpdx.y, q.dpdy.y) *
                        filtered_wave(q.p.z, q.dpdx.z, q.dpdy.z));
}

PatternFloat dots(const PatternPoint2& q) {
  constexpr float radius = 0.35f, shift = 0.5f - radius;
  const PatternFloat cs = floor(q.s + 0.5f), ct = floor(q.t + 0.5f);
  const PatternFloat ds = q.s - cs - plane_noise(cs + 1.5f, ct + 2.8f) * shift;
  const PatternFloat dt = q.t - ct - plane_noise(cs + 4.5f, ct + 9.8f) * shift;
  return less(0, plane_noise(cs + 0.5f, ct + 0.5f)) * less(ds * ds + dt * dt, radius * radius);
}

PatternFloat facing(PatternGraph& graph, const V3f& direction) {
  return min(abs(dot(surface_vector(graph, PatternInput::Ngx), direction)), 1);
}

PatternFloat bilerp(const PatternPoint2& q, float v00, float v01, float v10, float v11) {
  const PatternFloat s = q.s, t = q.t, s0 = 1 - s, t0 = 1 - t;
  return s0 * t0 * v00 + s * t0 * v10 + s0 * t * v01 + s * t * v11;
}

PatternColor bilerp(const PatternPoint2& q, const RGB& v00, const RGB& v01, const RGB& v10, const RGB& v11) {
  const auto channel = [&](int c) { return bilerp(q, v00[c], v01[c], v10[c], v11[c]); };
  return {channel(0), channel(1), channel(2)};
}

PatternColor rgb_to_hsv(const PatternColor& c) {
  return apply3(PatternOp::rgb_to_hsv, {c.r, c.g, c.b});
}

PatternColor hsv_to_rgb(const PatternColor& c) {
  return apply3(PatternOp::hsv_to_rgb, {c.r, c.g, c.b});
}

PatternFloat image_float(const PatternPoint2& q, const image::TextureHandle& image,
                         const ImageTextureOptions& options) {
  return finished({&q.s.graph(), look_up(q, image, options, 1)[0]}, options);
}

PatternColor image_color(const PatternPoint2& q, const image::TextureHandle& image,
                         const ImageTextureOptions& options) {
  return each([&](PatternFloat v) { return finished(v, options); }, color(q.s.graph(), look_up(q, image, options, 3)));
}

}  // namespace dapple::pattern
