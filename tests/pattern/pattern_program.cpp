// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_program.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "dapple/pattern/noise.h"
#include "dapple/pattern/pattern_ramp.h"
#include "dapple/pattern/patterns.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

constexpr int capacity = ShadingPoints::capacity;
using Values = std::array<float, capacity>;

Values evaluate(const PatternFloat& pattern, const ShadingPoints& points,
                const PatternKernels& kernels = native_pattern_kernels()) {
  Values out{};
  const PatternProgram::Output output{out.data()};
  PatternProgram(std::span(&pattern, 1)).evaluate(points, std::span(&output, 1), kernels);
  return out;
}

bool same(float a, float b) {
  return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b) || (a == 0 && b == 0) ||
         (std::isnan(a) && std::isnan(b));
}

/// The value of a pattern at one point by recursion over the graph: nothing shared, nothing scheduled.
float naive(const PatternGraph& graph, PatternGraph::Value v, const ShadingPoints& p, int i);

std::array<float, 3> cells(float x, float y, float z, float jitter) {
  float f1 = 100, f2 = 100, id = 0;
  for (int k = 0; k < 27; ++k) {
    const int cx = int(std::floor(x)) + k % 3 - 1, cy = int(std::floor(y)) + k / 3 % 3 - 1,
              cz = int(std::floor(z)) + k / 9 - 1;
    const uint32_t h = lane::lattice_hash(cx, cy, cz);
    const auto at = [&](int c, uint32_t bits) { return float(c) + 0.5f + jitter * (lane::unit_of(bits) - 0.5f); };
    const float d = length(V3f(at(cx, h), at(cy, h >> 10), at(cz, h >> 20)) - V3f(x, y, z));
    if (d < f1)
      f2 = f1, f1 = d, id = lane::unit_of((h * 0x9e3779b1u) >> 22);
    else
      f2 = std::min(f2, d);
  }
  return {f1, f2, id};
}

float naive_input(PatternInput input, const ShadingPoints& p, int i) {
  switch (input) {
    case PatternInput::u:
      return p.u[i];
    case PatternInput::v:
      return p.v[i];
    case PatternInput::Px:
      return p.P.x[i];
    case PatternInput::Py:
      return p.P.y[i];
    case PatternInput::Nsz:
      return p.Ns.z[i];
    case PatternInput::dPdy_z:
      return p.dPdy.z[i];
    default:
      ADD_FAILURE() << "unexpected input";
      return 0;
  }
}

float naive(const PatternGraph& graph, PatternGraph::Value v, const ShadingPoints& p, int i) {
  const PatternGraph::Node& n = graph.node(v);
  float x[6] = {};
  for (size_t k = 0; k < n.operand_count; ++k) x[k] = naive(graph, n.operands[k], p, i);
  switch (n.op) {
    case PatternOp::constant:
      return *graph.number(v);
    case PatternOp::input:
      return naive_input(static_cast<PatternInput>(n.data), p, i);
    case PatternOp::absolute:
      return std::abs(x[0]);
    case PatternOp::floor:
      return std::floor(x[0]);
    case PatternOp::sqrt:
      return std::sqrt(std::max(x[0], 0.0f));
    case PatternOp::exp:
      return lane::exp(x[0]);
    case PatternOp::log:
      return lane::log(x[0]);
    case PatternOp::sin:
      return lane::sin(x[0]);
    case PatternOp::cos:
      return lane::cos(x[0]);
    case PatternOp::add:
      return x[0] + x[1];
    case PatternOp::subtract:
      return x[0] - x[1];
    case PatternOp::multiply:
      return x[0] * x[1];
    case PatternOp::divide:
      return x[1] == 0 ? 0 : x[0] / x[1];
    case PatternOp::minimum:
      return x[0] < x[1] ? x[0] : x[1];
    case PatternOp::maximum:
      return x[0] > x[1] ? x[0] : x[1];
    case PatternOp::modulo:
      return x[1] == 0 ? 0 : x[0] - x[1] * std::floor(x[0] / x[1]);
    case PatternOp::power:
      return lane::pow(x[0], x[1]);
    case PatternOp::atan2:
      return lane::atan2(x[0], x[1]);
    case PatternOp::less:
      return x[0] < x[1] ? 1 : 0;
    case PatternOp::square_wave:
      return lane::square_wave(x[0], x[1]);
    case PatternOp::select:
      return x[0] != 0 ? x[1] : x[2];
    case PatternOp::mix:
      return x[0] * (1 - x[2]) + x[1] * x[2];
    case PatternOp::smoothstep:
      return lane::smoothstep(x[0], x[1], x[2]);
    case PatternOp::perlin:
      return lane::gradient_noise(x[0], x[1], x[2]);
    case PatternOp::simplex:
      return lane::simplex_noise(x[0], x[1], x[2]);
    default:
      ADD_FAILURE() << "unexpected op";
      return 0;
  }
}

/// A random graph: its last value depends on many of the others.
PatternFloat random_pattern(PatternGraph& graph, KeyedRng& rng, int size) {
  using enum PatternOp;
  static constexpr PatternOp ops[]{absolute,
                                   PatternOp::floor,
                                   PatternOp::sqrt,
                                   sin,
                                   cos,
                                   add,
                                   subtract,
                                   multiply,
                                   divide,
                                   minimum,
                                   maximum,
                                   modulo,
                                   less,
                                   select,
                                   mix,
                                   add,
                                   multiply,
                                   perlin,
                                   simplex,
                                   smoothstep,
                                   square_wave,
                                   power,
                                   PatternOp::atan2,
                                   PatternOp::exp,
                                   PatternOp::log};
  std::vector<PatternGraph::Value> values;
  for (const PatternInput i :
       {PatternInput::u, PatternInput::v, PatternInput::Px, PatternInput::Py, PatternInput::Nsz, PatternInput::dPdy_z})
    values.push_back(graph.input(i));
  for (const float c : {0.0f, 1.0f, 0.5f, -3.0f}) values.push_back(graph.constant(c));
  const auto pick = [&](size_t n) { return std::min(size_t(rng.next() * float(n)), n - 1); };
  for (int k = 0; k < size; ++k) {
    const PatternOp op = ops[pick(std::size(ops))];
    std::vector<PatternGraph::Value> operands;
    for (int i = 0; i < operand_count(op); ++i)
      operands.push_back(values[rng.next() < 0.3f ? pick(values.size())
                                                  : values.size() - 1 - pick(std::min<size_t>(values.size(), 6))]);
    values.push_back(graph.apply(op, operands)[0]);
  }
  return {&graph, values.back()};
}

TEST(PatternProgram, RandomGraphsAreWhatANaiveInterpreterSays) {
  rc::check([] {
    KeyedRng rng(*rc::gen::arbitrary<uint64_t>());
    PatternGraph graph;
    const PatternFloat pattern = random_pattern(graph, rng, 1 + int(rng.next() * 18));
    const auto points = test::random_points(rng.next_bits(), 0.1f, 3);
    points->count = 5;
    const Values out = evaluate(pattern, *points);
    for (int i = 0; i < points->count; ++i) {
      const float expected = naive(graph, pattern.value(), *points, i);
      RC_ASSERT(same(out[size_t(i)], expected) || !std::isfinite(expected));
    }
  });
}

TEST(PatternProgram, BatchesLanesAndInstructionSetsGiveTheSameBits) {
  rc::check([] {
    KeyedRng rng(*rc::gen::arbitrary<uint64_t>());
    PatternGraph graph;
    const PatternPoint3 q = solid_mapping(graph, Transform::scale({0.3, 0.3, 0.3}));
    const PatternCells cell = worley(q, 0.8f);
    const PatternColor color = hsv_to_rgb({cell.id, cell.f1, marble(q, 4, 0.5f, 2, 0.3f).g});
    const std::array outputs{random_pattern(graph, rng, 60), fbm(q, 5, 0.6f) + windy(q),
                             turbulence(q, 3, 0.5f) * cell.f2, color.g, dots(uv_mapping(graph))};
    const auto points = test::random_points(rng.next_bits(), 0.05f, 3);
    const auto values = [&](const PatternProgram& program, const ShadingPoints& p, const PatternKernels& kernels) {
      std::array<Values, 5> out{};
      program.evaluate(p,
                       std::array<PatternProgram::Output, 5>{
                           {{out[0].data()}, {out[1].data()}, {out[2].data()}, {out[3].data()}, {out[4].data()}}},
                       kernels);
      return out;
    };
    const PatternProgram program(outputs), narrow(outputs, 24);
    const auto whole = values(program, *points, native_pattern_kernels());
    const auto chunks = values(narrow, *points, native_pattern_kernels());
    const auto baseline = values(program, *points, baseline_pattern_kernels());
    const auto few = std::make_unique<ShadingPoints>(*points);
    few->count = 1 + int(rng.next() * 250);
    const auto start = values(program, *few, native_pattern_kernels());
    for (int i = 0; i < capacity; i += 17) {
      const auto one = std::make_unique<ShadingPoints>();
      one->gather(*points, std::array{i});
      const auto alone = values(program, *one, native_pattern_kernels());
      for (size_t k = 0; k < outputs.size(); ++k) {
        const float expected = whole[k][size_t(i)];
        RC_ASSERT(same(alone[k][0], expected));
        RC_ASSERT(same(chunks[k][size_t(i)], expected));
        RC_ASSERT(same(baseline[k][size_t(i)], expected));
        if (i < few->count) RC_ASSERT(same(start[k][size_t(i)], expected));
      }
    }
  });
}

TEST(PatternProgram, EqualExpressionsAreOne) {
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u), v = pattern_input(graph, PatternInput::v);
  EXPECT_EQ(sin(u * v + 1), sin(v * u + 1));
  EXPECT_NE(u - v, v - u);
  const PatternPoint3 q = solid_mapping(graph, Transform());
  EXPECT_EQ(fbm(q, 4, 0.5f), fbm(q, 4, 0.5f));
  EXPECT_NE(fbm(q, 4, 0.5f), fbm(q, 5, 0.5f));
  EXPECT_EQ(u + 0, u);
  EXPECT_EQ(u * 0, u.number(0));
  EXPECT_EQ(sin(u.number(2)).constant(), lane::sin(2));
  EXPECT_EQ(select(u.number(1), u, v), u);
  EXPECT_EQ(select(u, v, v), v);
  const PatternColor hsv = rgb_to_hsv(pattern_number(graph, RGB(0, 1, 0)));
  EXPECT_EQ(hsv.constant(), RGB(1.0f / 3, 1, 1));
}

TEST(PatternProgram, WhatNoOutputNeedsIsNotComputed) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform::rotate(30, {1, 1, 0}));
  const PatternFloat unused = fbm(q, 8, 0.5f) * worley(q, 1).f1;
  EXPECT_GT(PatternProgram(std::span(&unused, 1)).instruction_count(), 10u);
  const PatternFloat sum = pattern_input(graph, PatternInput::u) + 1;
  EXPECT_EQ(PatternProgram(std::span(&sum, 1)).instruction_count(), 1u);
  // Footprints are computed for those who filter only.
  const PatternFloat s = planar_mapping(graph, Transform::rotate(30, {1, 1, 0}), {1, 0, 0}, {0, 1, 0}, 0, 0).s;
  EXPECT_LE(PatternProgram(std::span(&s, 1)).instruction_count(), 3u);
}

TEST(PatternProgram, OutputsShareWhatTheyCan) {
  PatternGraph graph;
  const PatternFloat noise = fbm(solid_mapping(graph, Transform()), 4, 0.5f);
  const std::array outputs{noise * 2, noise + 1, noise.number(7), pattern_input(graph, PatternInput::v), noise * 2};
  const PatternProgram program(outputs);
  EXPECT_EQ(program.instruction_count(), PatternProgram(std::span(&noise, 1)).instruction_count() + 2);
  const auto points = test::random_points(4, 0.01f);
  std::array<Values, 5> out;
  program.evaluate(*points, std::array<PatternProgram::Output, 5>{
                                {{out[0].data()}, {out[1].data()}, {out[2].data()}, {out[3].data()}, {out[4].data()}}});
  const Values expected = evaluate(noise, *points);
  for (size_t i = 0; i < capacity; ++i) {
    EXPECT_EQ(out[0][i], expected[i] * 2);
    EXPECT_EQ(out[1][i], expected[i] + 1);
    EXPECT_EQ(out[2][i], 7);
    EXPECT_EQ(out[3][i], points->v[i]);
    EXPECT_EQ(out[4][i], out[0][i]);
  }
}

TEST(PatternProgram, FewRegistersServeLongAndDeepGraphs) {
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u);
  PatternFloat chain = u;
  for (int i = 0; i < 100000; ++i) chain = sin(chain + u);
  const PatternProgram deep(std::span(&chain, 1));
  EXPECT_EQ(deep.instruction_count(), 200000u);
  EXPECT_LE(deep.register_count(), 2);

  // A balanced tree over 2^12 leaves, made level by level, the worst order.
  std::vector<PatternFloat> level;
  for (int i = 0; i < 4096; ++i) level.push_back(sin(u * float(i)));
  while (level.size() > 1) {
    std::vector<PatternFloat> next;
    for (size_t i = 0; i < level.size(); i += 2) next.push_back(min(level[i], level[i + 1]));
    level = next;
  }
  EXPECT_LE(PatternProgram(std::span(&level[0], 1)).register_count(), 14);
}

TEST(PatternProgram, ManyLiveValuesNeedNotFitTheStack) {
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u);
  std::vector<PatternFloat> outputs;
  for (int i = 0; i < 3000; ++i) outputs.push_back(u + float(i + 1));
  const PatternProgram program(outputs);
  EXPECT_EQ(program.register_count(), 3000);
  const auto points = test::random_points(4, 0);
  std::vector<Values> out(outputs.size());
  std::vector<PatternProgram::Output> places;
  for (Values& v : out) places.push_back({v.data()});
  program.evaluate(*points, places);
  for (size_t k = 0; k < out.size(); k += 271)
    for (size_t i = 0; i < capacity; ++i) EXPECT_EQ(out[k][i], points->u[i] + float(k + 1));
}

TEST(PatternProgram, CellsRampsAndColoursAgreeWithScalars) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform());
  const auto points = test::random_points(8, 0, 20);
  const PatternCells c = worley(q, 0.7f);
  const Values f1 = evaluate(c.f1, *points), f2 = evaluate(c.f2, *points), id = evaluate(c.id, *points);
  for (int i = 0; i < capacity; ++i) {
    const V3f p = points->P[i];
    const auto expected = cells(p.x, p.y, p.z, 0.7f);
    EXPECT_NEAR(f1[size_t(i)], expected[0], 1e-5f);
    EXPECT_NEAR(f2[size_t(i)], expected[1], 1e-5f);
    EXPECT_EQ(id[size_t(i)], expected[2]);
  }
  const PatternFloat u = pattern_input(graph, PatternInput::u), v = pattern_input(graph, PatternInput::v);
  const PatternColor rgb{fract(u), fract(v), fract(u + v)}, hsv = rgb_to_hsv(rgb), back = hsv_to_rgb(hsv);
  const Values r = evaluate(rgb.r, *points), g = evaluate(rgb.g, *points), b = evaluate(rgb.b, *points),
               r2 = evaluate(back.r, *points), g2 = evaluate(back.g, *points), b2 = evaluate(back.b, *points),
               value = evaluate(hsv.b, *points);
  for (size_t i = 0; i < capacity; ++i) {
    EXPECT_NEAR(r[i], r2[i], 1e-5f);
    EXPECT_NEAR(g[i], g2[i], 1e-5f);
    EXPECT_NEAR(b[i], b2[i], 1e-5f);
    EXPECT_EQ(value[i], std::max(r[i], std::max(g[i], b[i])));
  }
}

TEST(Ramp, PassesThroughItsKnots) {
  PatternGraph graph;
  const PatternFloat x = pattern_number(graph, 0);
  const std::array at{-1.0f, 0.0f, 0.5f, 0.5f, 2.0f}, y{1.0f, 3.0f, 2.0f, 5.0f, 4.0f};
  for (const auto interpolation :
       {RampInterpolation::constant, RampInterpolation::linear, RampInterpolation::smooth, RampInterpolation::spline}) {
    const PatternRamp ramp(at, y, 1, interpolation);
    const auto value = [&](float v) { return *ramp(x.number(v)).constant(); };
    EXPECT_EQ(value(-7), 1);
    EXPECT_EQ(value(-1), 1);
    EXPECT_EQ(value(0), 3);
    EXPECT_EQ(value(0.5f), 5);
    EXPECT_FLOAT_EQ(value(2), 4);
    EXPECT_EQ(value(9), 4);
    for (float v = -2; v < 3; v += 0.01f) EXPECT_TRUE(value(v) >= 0.999f && value(v) <= 5.001f) << v;  // no overshoot
    if (interpolation != RampInterpolation::constant) {
      EXPECT_NEAR(value(0.4999f), 2, 2e-3f);
    }
  }
  EXPECT_EQ(*PatternRamp(at, y, 1, RampInterpolation::linear)(x.number(-0.75f)).constant(), 1.5f);
  EXPECT_EQ(*PatternRamp(at, y, 1, RampInterpolation::smooth)(x.number(-0.5f)).constant(), 2);
  EXPECT_EQ(*PatternRamp(at, y, 1, RampInterpolation::constant)(x.number(-0.01f)).constant(), 1);
}

TEST(Footprint, IsTheChangeToTheNextSample) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform::rotate(20, {1, 2, 3}));
  const PatternFloat u = pattern_input(graph, PatternInput::u), v = pattern_input(graph, PatternInput::v);
  const PatternRamp ramp(std::array{0.0f, 0.4f, 1.0f}, std::array{0.0f, 2.0f, 1.0f}, 1, RampInterpolation::smooth);
  const std::array patterns{u * v + sin(u * 2) * cos(v),
                            exp(u * 0.3f) / (v * v + 1),
                            sqrt(u * u + 1) + log(v * v + 2),
                            atan2(u, v * v + 3),
                            pow(u * u + 1, 1.3f),
                            mix(u, v * 2, u * v),
                            min(u, v) + max(u * 2, v),
                            abs(u - v),
                            select(less(u, v), u * 3, v * 2),
                            smoothstep(u.number(-5), u.number(5), u + v),
                            ramp(fract(u * 0.01f + 0.5f)),
                            expression::apply(PatternOp::perlin, q.p.x, q.p.y, q.p.z),
                            rgb_to_hsv({u * u + 1, v * v, u.number(0.5f)}).g};
  const auto points = test::random_points(12, 1e-3f, 2);
  for (size_t k = 0; k < patterns.size(); ++k)
    for (const int axis : {0, 1}) {
      const auto ahead = std::make_unique<ShadingPoints>(*points), behind = std::make_unique<ShadingPoints>(*points);
      for (const float side : {0.5f, -0.5f}) {
        ShadingPoints& p = side > 0 ? *ahead : *behind;
        for (int i = 0; i < capacity; ++i) {
          p.P.set(i, points->P[i] + (axis == 0 ? points->dPdx[i] : points->dPdy[i]) * side);
          p.u[i] += side * (axis == 0 ? points->dudx[i] : points->dudy[i]);
          p.v[i] += side * (axis == 0 ? points->dvdx[i] : points->dvdy[i]);
        }
      }
      const Values footprint = evaluate(patterns[k].footprint(axis), *points);
      const Values a = evaluate(patterns[k], *ahead), b = evaluate(patterns[k], *behind);
      int off = 0;
      for (size_t i = 0; i < capacity; ++i)
        off += std::abs(footprint[i] - (a[i] - b[i])) > 2e-5f + 0.02f * std::abs(footprint[i]);
      EXPECT_LE(off, 3) << "pattern " << k << " axis " << axis;  // points within a footprint of an edge
    }
  EXPECT_EQ(floor(u).footprint(0).constant(), 0);
  EXPECT_EQ(pattern_input(graph, PatternInput::Nsx).footprint(1).constant(), 0);
}

}  // namespace
}  // namespace dapple::pattern
