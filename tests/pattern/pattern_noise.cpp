// SPDX-License-Identifier: Apache-2.0
// Simplex and cellular noise; gradient noise is in patterns.cpp.
#include <gtest/gtest.h>

#include "dapple/pattern/noise.h"
#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/patterns.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

constexpr int capacity = ShadingPoints::capacity;

V3f random_point(KeyedRng& rng, float extent) {
  const auto in = [&] { return extent * (2 * rng.next() - 1); };
  const float x = in(), y = in();
  return {x, y, in()};
}

float simplex_at(const V3f& p) {
  return lane::simplex_noise(p.x, p.y, p.z);
}

TEST(SimplexNoise, ZeroAtItsCornersContinuousAndBounded) {
  KeyedRng rng(3);
  double sum = 0, squares = 0;
  float lowest = 0, highest = 0, steepest = 0;
  constexpr int n = 300000;
  for (int i = 0; i < n; ++i) {
    const V3f p = random_point(rng, 100);
    const float v = simplex_at(p);
    sum += v, squares += v * v;
    lowest = std::min(lowest, v), highest = std::max(highest, v);
    steepest = std::max(steepest, std::abs(simplex_at(p + V3f(7e-4f, -5e-4f, 5e-4f)) - v) / 1e-3f);
    if (i < 1000) {
      // A corner of the lattice: i - G (i + j + k), G = 1 / 6; its own part is zero, and it is farther than sqrt(1/2)
      // from others.
      const V3f c(std::floor(p.x), std::floor(p.y), std::floor(p.z));
      const float g = (c.x + c.y + c.z) / 6;
      EXPECT_NEAR(simplex_at(c - V3f(g, g, g)), 0, 1e-3f);
    }
  }
  EXPECT_NEAR(sum / n, 0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / n), 0.35, 0.07);
  EXPECT_LT(highest, 1.05f);
  EXPECT_GT(lowest, -1.05f);
  EXPECT_GT(highest, 0.85f);
  EXPECT_LT(lowest, -0.85f);
  EXPECT_LT(steepest, 12);  // a jump would show as 100 or more
  EXPECT_TRUE(std::isfinite(simplex_at({infinity, 3e38f, -1e30f})));
}

/// Where the feature point of a cell is, from its definition.
V3f feature(const V3f& cell, float jitter) {
  const uint32_t h = lane::lattice_hash(int(cell.x), int(cell.y), int(cell.z));
  const auto at = [&](uint32_t bits) { return 0.5f + jitter * (lane::unit_of(bits) - 0.5f); };
  return cell + V3f(at(h), at(h >> 10), at(h >> 20));
}

struct CellValues {
  float f1[capacity], f2[capacity], id[capacity];
  CellValues(const ShadingPoints& points, float jitter) {
    PatternGraph graph;
    const PatternCells c = worley(solid_mapping(graph, Transform()), jitter);
    const PatternProgram program(std::array{c.f1, c.f2, c.id});
    program.evaluate(points, std::array<PatternProgram::Output, 3>{{{f1}, {f2}, {id}}});
  }
};

TEST(CellularNoise, DistancesAreThoseOfBruteForce) {
  for (const float jitter : {0.0f, 0.5f, 1.0f}) {
    const auto points = test::random_points(9, 0, 30);
    const CellValues values(*points, jitter);
    for (int i = 0; i < capacity; ++i) {
      const V3f p = points->P[i];
      float f1 = 100, f2 = 100;
      for (int k = 0; k < 125; ++k) {
        const V3f cell(std::floor(p.x) + float(k % 5 - 2), std::floor(p.y) + float(k / 5 % 5 - 2),
                       std::floor(p.z) + float(k / 25 - 2));
        const float d = length(feature(cell, jitter) - p);
        if (d < f1)
          f2 = f1, f1 = d;
        else
          f2 = std::min(f2, d);
      }
      if (f1 <= 1) {
        EXPECT_NEAR(values.f1[i], f1, 1e-4f) << i;
      } else {
        EXPECT_GE(values.f1[i], f1 - 1e-4f) << i;
      }
      if (f2 <= 1) {
        EXPECT_NEAR(values.f2[i], f2, 1e-4f) << i;
      } else {
        EXPECT_GE(values.f2[i], f2 - 1e-4f) << i;
      }
      EXPECT_TRUE(values.id[i] >= 0 && values.id[i] < 1);
    }
  }
}

TEST(CellularNoise, FarAwayIsItsMean) {
  for (const float jitter : {0.0f, 0.5f, 1.0f}) {
    double f1 = 0, f2 = 0, id = 0;
    constexpr int batches = 200;
    for (uint64_t batch = 0; batch < batches; ++batch) {
      const auto points = test::random_points(batch, 0, 50);
      const CellValues values(*points, jitter);
      for (int i = 0; i < capacity; ++i) f1 += values.f1[i], f2 += values.f2[i], id += values.id[i];
    }
    const auto points = test::random_points(1, 0, 50);
    std::fill_n(points->dPdx.x, capacity, 3.0f);
    const CellValues mean(*points, jitter);
    constexpr double n = batches * capacity;
    EXPECT_NEAR(mean.f1[5], f1 / n, 0.01) << jitter;
    EXPECT_NEAR(mean.f2[5], f2 / n, 0.01) << jitter;
    EXPECT_NEAR(mean.id[5], id / n, 0.01);
    EXPECT_EQ(mean.f1[5], mean.f1[6]);
  }
}

TEST(Noise, FootprintsFadeWhatIsNotResolved) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform());
  for (const PatternFloat pattern : {perlin(q), simplex(q)}) {
    const auto texture = make_texture(pattern);
    EXPECT_EQ(test::value_at(*texture, V3f(0.3f, 0.6f, 0.2f), 1), 0);
    EXPECT_EQ(test::value_at(*texture, V3f(0.3f, 0.6f, 0.2f), 0.01f), test::value_at(*texture, V3f(0.3f, 0.6f, 0.2f)));
  }
}

}  // namespace
}  // namespace dapple::pattern
