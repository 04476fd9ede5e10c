// SPDX-License-Identifier: Apache-2.0
// Bent operations over filtered noises keep their means.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/pattern_ramp.h"
#include "dapple/pattern/patterns.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

constexpr int capacity = ShadingPoints::capacity;

using Network = std::function<PatternFloat(const PatternPoint3&)>;

/// Over space, by samples with footprints of this width.
double mean(const Network& network, float width) {
  PatternGraph graph;
  const PatternProgram program(std::array{network(solid_mapping(graph, Transform()))});
  double sum = 0;
  constexpr int batches = 400;
  for (uint64_t batch = 0; batch < batches; ++batch) {
    const auto points = test::random_points(batch, 0, 50);
    std::fill_n(points->dPdx.x, capacity, width);
    float values[capacity];
    program.evaluate(*points, std::array<PatternProgram::Output, 1>{{{values}}});
    for (const float v : values) sum += v;
  }
  return sum / (batches * capacity);
}

PatternFloat ramp_of(PatternFloat x, std::vector<float> positions, std::vector<float> values) {
  return PatternRamp(positions, values, 1, RampInterpolation::linear)(x);
}

struct Case {
  const char* name;
  Network network;
  float tolerance;
};

class PatternSpread : public testing::TestWithParam<Case> {};

TEST_P(PatternSpread, MeansAreThoseOfUnfilteredPatterns) {
  const double exact = mean(GetParam().network, 0);
  for (const float width : {0.1f, 0.2f, 0.35f, 0.5f, 1.0f, 4.0f})
    EXPECT_NEAR(mean(GetParam().network, width), exact, GetParam().tolerance) << width;
}

// At the mean of the noise alone they are wrong by .16 to .8. Cells are not spread normally: hence their tolerances.
const Case cases[] = {
    {"ramp_over_cells",
     [](const PatternPoint3& q) {
       return ramp_of(worley(q, 1).f1, {.4f, .7f}, {0, 1});
     },
     .015f},
    {"peak_over_fbm",
     [](const PatternPoint3& q) {
       return ramp_of(fbm(q, 4, .5f), {-.2f, 0, .2f}, {0, 1, 0});
     },
     .03f},
    {"threshold_of_fbm", [](const PatternPoint3& q) { return less(.2f, fbm(q, 4, .5f)); }, .015f},
    {"spots_of_simplex", [](const PatternPoint3& q) { return less(.4f, simplex(q)); }, .015f},
    {"chosen_by_cells",
     [](const PatternPoint3& q) {
       const PatternFloat rare = less(.8f, worley(q, 1).id);
       return select(rare, rare.number(5), rare.number(1));
     },
     .22f},
    {"borders_of_cells",
     [](const PatternPoint3& q) {
       const PatternCells c = worley(q, 1);
       return less(c.f2 - c.f1, .1f);
     },
     .09f},
    {"noise_below_noise", [](const PatternPoint3& q) { return less(fbm(q, 4, .5f), fbm(q * 2, 4, .5f)); }, .03f},
    {"steps", [](const PatternPoint3& q) { return floor(fbm(q, 4, .5f) * 3); }, .11f},
    {"fraction", [](const PatternPoint3& q) { return fract(fbm(q, 4, .5f) * 3); }, .11f},
    {"narrow_waves", [](const PatternPoint3& q) { return cos(fbm(q, 4, .5f) * 16); }, .02f},
    {"threshold_of_a_square",
     [](const PatternPoint3& q) {
       const PatternFloat n = fbm(q, 4, .5f);
       return less(.1f, n * n);
     },
     .17f},
    {"threshold_of_twice",
     [](const PatternPoint3& q) {
       const PatternFloat n = fbm(q, 4, .5f);
       return less(.4f, n + n);
     },
     .015f},
    {"ridges", [](const PatternPoint3& q) { return 1 - abs(perlin(q)); }, .01f},
    {"clamped_and_squared",
     [](const PatternPoint3& q) {
       const PatternFloat x = clamp(fbm(q, 3, .5f) * 2, 0, 1);
       return x * x;
     },
     .03f},
    {"chain",
     [](const PatternPoint3& q) {
       const PatternFloat x = PatternFloat(smoothstep(q.p.x.number(-.1f), q.p.x.number(.3f), fbm(q * 2, 4, .6f)));
       return ramp_of(x * .8f + .1f, {0, .5f, 1}, {0, .1f, 1});
     },
     .025f},
};
INSTANTIATE_TEST_SUITE_P(Networks, PatternSpread, testing::ValuesIn(cases),
                         [](const auto& one) { return one.param.name; });

TEST(PatternSpreads, LeaveNearPatternsAsTheyAre) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform());
  const std::vector<float> positions{-.2f, 0, .2f}, values{0, 1, .3f};
  const PatternRamp ramp(positions, values, 1, RampInterpolation::smooth);
  const PatternFloat noise = fbm(q, 4, .5f);
  // The same operations on a noise that states no spread.
  const PatternGraph::Value operands[]{q.p.x.value(), q.p.y.value(), q.p.z.value(), graph.constant(0)};
  const PatternFloat bare{&graph, graph.apply(PatternOp::fbm, operands, {4, .5f})[0]};
  const PatternProgram program(std::array{ramp(noise), ramp(bare), less(.1f, noise), less(.1f, bare)});
  const auto points = test::random_points(1, 0, 50);
  float out[4][capacity];
  program.evaluate(*points, std::array<PatternProgram::Output, 4>{{{out[0]}, {out[1]}, {out[2]}, {out[3]}}});
  for (int i = 0; i < capacity; ++i) {
    EXPECT_EQ(out[0][i], out[1][i]) << i;
    EXPECT_EQ(out[2][i], out[3][i]) << i;
  }
}

TEST(PatternSpreads, FollowDeepNetworks) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform());
  PatternFloat v = fbm(q, 4, .5f);
  for (int layer = 0; layer < 60; ++layer) v = mix(v, v * 0.9f, simplex(q * float(layer)));
  EXPECT_FALSE(less(.1f, v).spread().constant());
  EXPECT_LT(graph.size(), 10000u);
}

TEST(PatternSpreads, OverflowTheSameInAnyBatch) {
  PatternGraph graph;
  const PatternFloat steep = exp(fbm(solid_mapping(graph, Transform()), 4, .5f) * 400);
  const PatternProgram program(std::array{steep});
  const auto points = test::random_points(1, 0, 50);
  for (int i = 0; i < capacity; i += 2) points->dPdx.x[i] = 4;
  float together[capacity];
  program.evaluate(*points, std::array<PatternProgram::Output, 1>{{{together}}});
  for (int i = 0; i < capacity; ++i) {
    EXPECT_FALSE(std::isnan(together[i]));
    const auto alone = std::make_unique<ShadingPoints>(*points);
    alone->count = 1;
    alone->P.set(0, points->P[i]);
    alone->dPdx.set(0, points->dPdx[i]);
    float value;
    program.evaluate(*alone, std::array<PatternProgram::Output, 1>{{{&value}}});
    EXPECT_EQ(value, together[i]) << i;
  }
}

TEST(PatternSpreads, GrowNoNodesWhereNothingIsFiltered) {
  PatternGraph graph;
  const PatternFloat u = pattern_input(graph, PatternInput::u), half = u.number(0.5f);
  EXPECT_EQ(u.spread().constant(), 0);
  const size_t before = graph.size();
  const PatternFloat v = max(u, half);
  EXPECT_EQ(v.spread().constant(), 0);
  EXPECT_EQ(graph.size(), before + 1);
}

}  // namespace
}  // namespace dapple::pattern
