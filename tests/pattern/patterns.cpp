// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/patterns.h"

#include <gtest/gtest.h>

#include "dapple/pattern/noise.h"
#include "dapple/pattern/pattern_program.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

using test::random_points;
using test::value_at;

float square_wave(double x) {
  return static_cast<long long>(std::floor(x)) % 2 == 0 ? 1.0f : -1.0f;
}

/// The average by brute force.
double tent_average(double x, double r) {
  constexpr int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double u = 2 * (i + 0.5) / n - 1;
    sum += (1 - std::abs(u)) * square_wave(x + r * u) * 2 / n;
  }
  return sum;
}

TEST(FilteredSquareWave, IsTheTentAverage) {
  KeyedRng rng(1);
  for (int i = 0; i < 300; ++i) {
    const float x = 20 * rng.next() - 10, r = std::exp2(10 * rng.next() - 8);
    EXPECT_NEAR(lane::square_wave(x, r), tent_average(x, r), 2e-3) << x << " " << r;
  }
}

TEST(FilteredSquareWave, StaysAccurateWhenNarrow) {
  // Half a tent beyond an edge far from the origin; the naive second difference is off by more than 10 here.
  for (const float edge : {0.0f, 7.0f, 1000.0f, -33.0f})
    for (const float r : {1e-3f, 0.01f, 0.3f, 0.5f}) {
      EXPECT_EQ(lane::square_wave(edge, r), 0);
      const float x = edge + 0.25f, far = 0.5f * sqr(std::max(0.0f, 1 - 0.25f / r));
      EXPECT_NEAR(lane::square_wave(x, r), square_wave(x) * (1 - 2 * far), 1e-5f) << edge << " " << r;
    }
  EXPECT_EQ(lane::square_wave(2.5f, 0), 1);
  EXPECT_EQ(lane::square_wave(-0.5f, 0), -1);
  EXPECT_NEAR(lane::square_wave(0.3f, 1e5f), 0, 1e-4f);
  EXPECT_EQ(lane::square_wave(std::numeric_limits<float>::quiet_NaN(), 1), 0);
  EXPECT_EQ(lane::square_wave(1, infinity), 0);
}

/// a and b mixed by a weight, as a texture.
FloatTexturePtr mixed(float a, float b, PatternFloat weight) {
  return make_texture(mix(weight.number(a), weight.number(b), weight));
}

TEST(Checkerboard, CellsAndTheirMean) {
  PatternGraph graph;
  const auto made = mixed(2, 6, checkerboard(uv_mapping(graph)));
  const FloatTexture& plane = *made;
  EXPECT_EQ(value_at(plane, 0.5f, 0.5f), 2);
  EXPECT_EQ(value_at(plane, 1.5f, 0.5f), 6);
  EXPECT_EQ(value_at(plane, 1.5f, -0.5f), 2);
  EXPECT_EQ(value_at(plane, -0.5f, 0.5f), 6);
  EXPECT_NEAR(value_at(plane, 0.3f, 0.8f, 50), 4, 1e-3f);
  const auto solid = mixed(2, 6, checkerboard(solid_mapping(graph, Transform())));
  const FloatTexture& space = *solid;
  EXPECT_EQ(value_at(space, V3f(0.5f, 0.5f, 0.5f)), 2);
  EXPECT_EQ(value_at(space, V3f(0.5f, 0.5f, 1.5f)), 6);
  EXPECT_EQ(value_at(space, V3f(-0.5f, 0.5f, 1.5f)), 2);
}

TEST(Checkerboard, FilteringIsTheMeanOfPointSamples) {
  PatternGraph graph;
  const auto made = make_texture(checkerboard(uv_mapping(graph)));
  const FloatTexture& checker = *made;
  const float width = 0.4f, reach = 1.5f * width;
  for (const auto& [u, v] : {std::pair{0.1f, 0.2f}, {0.95f, 1.5f}, {-3.3f, 0.02f}}) {
    double sum = 0, weight = 0;
    for (int i = 0; i < 100; ++i)
      for (int j = 0; j < 100; ++j) {
        const float a = (i + 0.5f) / 50 - 1, b = (j + 0.5f) / 50 - 1;
        const double w = (1 - std::abs(a)) * (1 - std::abs(b));
        sum += w * value_at(checker, u + reach * a, v + reach * b);
        weight += w;
      }
    EXPECT_NEAR(value_at(checker, u, v, width), sum / weight, 0.01) << u << " " << v;
  }
}

TEST(Dots, CoverTheirShare) {
  PatternGraph graph;
  const auto disks = make_texture(dots(uv_mapping(graph)));
  double inside = 0;
  constexpr int batches = 400;
  for (int b = 0; b < batches; ++b) {
    const auto points = random_points(100 + b, 0, 60);
    float out[ShadingPoints::capacity];
    disks->evaluate(*points, out);
    for (const float v : out) {
      EXPECT_TRUE(v == 0 || v == 1);
      inside += v;
    }
  }
  // About half of the cells hold a disk of area pi .35^2 = .385.
  const double share = inside / (batches * ShadingPoints::capacity);
  EXPECT_GT(share, 0.12);
  EXPECT_LT(share, 0.27);
}

float gradient_noise(const V3f& p) {
  return lane::gradient_noise(p.x, p.y, p.z);
}

TEST(Noise, ZeroOnTheLatticeSmoothAndBounded) {
  KeyedRng rng(7);
  double sum = 0, squares = 0;
  float lowest = 0, highest = 0;
  constexpr int n = 200000;
  for (int i = 0; i < n; ++i) {
    const auto coordinate = [&] { return 300 * (rng.next() - 0.5f); };
    const float x = coordinate(), y = coordinate();
    const V3f p(x, y, coordinate());
    const float v = gradient_noise(p);
    sum += v, squares += v * v;
    lowest = std::min(lowest, v), highest = std::max(highest, v);
    if (i < 1000) {
      EXPECT_EQ(gradient_noise({std::round(p.x), std::round(p.y), std::round(p.z)}), 0);
      EXPECT_NEAR(gradient_noise(p + V3f(1e-3f, 1e-3f, 1e-3f)), v, 0.01f);
      EXPECT_NEAR(gradient_noise(p + V3f(256, 0, -256)), v, 1e-3f);
    }
  }
  EXPECT_NEAR(sum / n, 0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / n), 0.27, 0.03);
  EXPECT_GT(lowest, -1.1f);
  EXPECT_LT(highest, 1.1f);
  EXPECT_LT(lowest, -0.7f);
  EXPECT_GT(highest, 0.7f);
  EXPECT_EQ(gradient_noise({infinity, 0, 0}), 0);
  EXPECT_TRUE(std::isfinite(gradient_noise({1e30f, -1e30f, 3e38f})));
}

/// Values of an independent program in double precision, written from the definition with pbrt's choice of gradients.
TEST(Noise, IsPerlinsOnPbrtsGradients) {
  const std::pair<V3f, float> values[] = {{{0.5f, 0.5f, 0.5f}, -0.125f},
                                          {{1.25f, -3.5f, 7.75f}, -0.185757637f},
                                          {{100.1f, 200.2f, -55.3f}, 0.406843216f},
                                          {{-0.75f, 255.5f, 12.125f}, -0.163819216f},
                                          {{3.3f, 4.4f, 5.5f}, 0.364273332f}};
  for (const auto& [p, expected] : values) EXPECT_NEAR(gradient_noise(p), expected, 2e-5f) << p.x;
}

/// fbm and turbulence at one point with a given footprint, by programs.
float fractal(PatternFloat (*f)(const PatternPoint3&, int, float), const V3f& p, const V3f& dpdx, const V3f& dpdy,
              int octaves) {
  PatternGraph graph;
  const auto texture = make_texture(f(solid_mapping(graph, Transform()), octaves, 0.5f));
  if (const auto c = texture->constant()) return *c;
  const auto points = random_points(1, 0);
  points->count = 1;
  points->P.set(0, p);
  points->dPdx.set(0, dpdx);
  points->dPdy.set(0, dpdy);
  float out;
  texture->evaluate(*points, &out);
  return out;
}

TEST(Noise, OctavesFollowTheFootprint) {
  const V3f p(0.3f, 0.7f, 1.9f);
  const V3f none(0, 0, 0);  // Imath's default is no value
  const auto narrow = [&](int octaves) { return fractal(fbm, p, none, none, octaves); };
  EXPECT_EQ(fractal(fbm, p, {1, 0, 0}, none, 8), 0);  // wavelength 1 is not resolved
  EXPECT_EQ(fractal(fbm, p, {0.125f, 0, 0}, none, 8), narrow(2));
  EXPECT_EQ(fractal(fbm, p, {0, 1e-4f, 0}, none, 8), narrow(8));
  EXPECT_NE(narrow(2), narrow(8));
  EXPECT_EQ(narrow(0), 0);
  EXPECT_EQ(narrow(1), gradient_noise(p));
  const float second = gradient_noise(p) + 0.5f * gradient_noise(p * 1.99f);
  EXPECT_FLOAT_EQ(narrow(2), second);
  EXPECT_FLOAT_EQ(fractal(turbulence, p, none, none, 2),
                  std::abs(gradient_noise(p)) + 0.5f * std::abs(gradient_noise(p * 1.99f)));
}

TEST(Noise, TurbulenceKeepsItsMean) {
  PatternGraph graph;
  const auto texture = make_texture(turbulence(solid_mapping(graph, Transform()), 6, 0.5f));
  double fine = 0, coarse = 0;
  for (uint64_t batch = 0; batch < 80; ++batch) {
    const auto points = random_points(batch, 0, 100);
    float out[ShadingPoints::capacity];
    texture->evaluate(*points, out);
    for (const float v : out) fine += v;
    std::fill_n(points->dPdx.x, points->count, 0.3f);
    texture->evaluate(*points, out);
    for (const float v : out) coarse += v;
  }
  EXPECT_NEAR(coarse / fine, 1, 0.2);
}

TEST(SolidTextures, RangesAndTransform) {
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, Transform::scale({3, 3, 3}).inverse());
  const auto points = random_points(11, 1e-3f, 50);
  float v[ShadingPoints::capacity];
  make_texture(fbm(q, 8, 0.5f))->evaluate(*points, v);
  EXPECT_NEAR(v[5], fractal(fbm, points->P[5] / 3, points->dPdx[5] / 3, points->dPdy[5] / 3, 8), 2e-4f);
  for (const float x : v) EXPECT_LT(std::abs(x), 2);
  make_texture(turbulence(q, 8, 0.5f))->evaluate(*points, v);
  for (const float x : v) EXPECT_TRUE(x > 0 && x < 2) << x;
  make_texture(windy(q))->evaluate(*points, v);
  for (const float x : v) EXPECT_LT(std::abs(x), 3);
  RGB c[ShadingPoints::capacity];
  make_texture(marble(q, 8, 0.5f, 2, 0.2f))->evaluate(*points, c);
  bool differ = false;
  for (const RGB& x : c) {
    EXPECT_TRUE(x.min() >= 0.25f && x.max() <= 0.95f);
    differ |= x != c[0];
  }
  EXPECT_TRUE(differ);
}

}  // namespace
}  // namespace dapple::pattern
