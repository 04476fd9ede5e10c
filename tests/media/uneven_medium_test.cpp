// SPDX-License-Identifier: Apache-2.0
// Quadratures of rays in media that differ from place to place, against closed forms and unbiased flights.
#include "dapple/media/uneven_medium.h"

#include <gtest/gtest.h>

#include "dapple/media/grid_medium.h"
#include "dapple/media/homogeneous_medium.h"
#include "dapple/media/pattern_medium.h"
#include "tests/support/chi_square.h"

namespace dapple::media {
namespace {

const Transform placed =
    Transform::translate(V3d(1, -2, 0.5)) * Transform::rotate(35, V3d(1, 2, 0.3)) * Transform::scale(V3d(3, 2, 4));
const Ray through{.o = placed.point(V3f(-0.6f, 0.35f, 0.2f)),
                  .d = normalize(placed.point(V3f(1.2f, 0.6f, 0.9f)) - placed.point(V3f(-0.6f, 0.35f, 0.2f)))};

PatternMedium even_box(const RGB& a, const RGB& s, const RGB& Le) {
  return {{.sigma_a = pattern::Input<RGB>(a), .sigma_s = pattern::Input<RGB>(s), .emission = pattern::Input<RGB>(Le)},
          placed,
          {},
          "even"};
}

// With empty cells between blobs.
GridMedium clumps(const RGB& a, const RGB& s, const RGB& Le) {
  std::vector<float> density;
  KeyedRng rng(3);
  for (int i = 0; i < 12 * 12 * 12; ++i) density.push_back(i % 12 / 3 == 1 ? 0 : std::max(4 * rng.next() - 2.2f, 0.0f));
  GridMedium::Content content;
  content.sigma_a = a, content.sigma_s = s, content.emission = Le;
  content.density = VoxelGrid<float>(std::move(density), 12, 12, 12);
  return {std::move(content), placed, {}};
}

// Rationale: a pattern that is one everywhere is an even medium in a box. Expectation: what is left and emitted of a
// ray as in closed form, whatever the draws, within the rounding of floats; where it scatters, the weight and the
// mean of the truncated exponential, by Z-tests of three channels.
TEST(UnevenMedium, IsExactWhereItIsEven) {
  const RGB a(0.1f, 0, 0.5f), s(0.5f, 1.2f, 0.2f), Le(1, 2, 3);
  const PatternMedium box = even_box(a, s, Le);
  const HomogeneousMedium even(a, s, Le, {});
  const Transform to_box = placed.inverse();
  float first = 0, last = infinity;  // where the ray is in the box
  const V3f o = to_box.point(through.o), d = to_box.vector(through.d);
  for (int k = 0; k < 3; ++k) {
    const float t0 = -o[k] / d[k], t1 = (1 - o[k]) / d[k];
    first = std::max(first, std::min(t0, t1)), last = std::min(last, std::max(t0, t1));
  }
  ASSERT_GT(last, first);
  const Ray inside{.o = through.o + through.d * first, .d = through.d};
  test::Moments weight[3], way[3];
  for (int i = 0; i < 40000; ++i) {
    const MediumCrossing found = box.cross(through, infinity, RGB(1, 0.5f, 2), hash(i), true);
    const RGB T = even.transmittance(inside, last - first, 0), emitted = even.emitted(inside, last - first);
    ASSERT_TRUE(found.scattering.scattered && found.scattering.t >= first && found.scattering.t <= last);
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(found.transmittance[c], T[c], 2e-5f * T[c]);
      ASSERT_NEAR(found.emitted[c], emitted[c], 2e-5f * emitted[c] + 1e-7f);
      weight[c].add(found.scattering.weight[c]);
      way[c].add(found.scattering.weight[c] * (found.scattering.t - first));
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double sigma = double(a[c] + s[c]), L = double(last - first), T = std::exp(-sigma * L);
    EXPECT_GT(test::z_test(weight[c], double(s[c]) / sigma * (1 - T), 1e-5), test::sidak(0.01, 6)) << c;
    EXPECT_GT(test::z_test(way[c], double(s[c]) / sigma * ((1 - T) / sigma - L * T), 1e-5), test::sidak(0.01, 6)) << c;
  }
  EXPECT_EQ(box.cross({.o = through.o, .d = -through.d}, infinity, RGB(1), 1, true).transmittance, RGB(1));
  EXPECT_FALSE(box.cross({.o = through.o, .d = -through.d}, infinity, RGB(1), 1, true).scattering.scattered);
}

// Rationale: clumps with nothing between them, of colours. Expectation: the quadrature's transmittance is
// e^-(depth) by fine sums within 1 % on the mean and 12 % RMS; what it emits and where it scatters, weighed by a
// function of the place, as unbiased flights say: Z-tests with 1 % for what a quadrature leaves out.
TEST(UnevenMedium, StandsForFlights) {
  const GridMedium medium = clumps(RGB(0.2f, 0, 0.6f), RGB(1, 1.6f, 0.3f), RGB(1, 2, 3));
  RGB depth;
  constexpr int steps = 20000;
  const float end = 8;
  std::vector<V3f> P(100);
  std::vector<MediumPoint> point(100);
  for (int i = 0; i < steps; i += 100) {
    for (int k = 0; k < 100; ++k) P[size_t(k)] = through.o + through.d * (end * (float(i + k) + 0.5f) / steps);
    medium.coefficients(P.data(), 0, 100, point.data());
    for (const MediumPoint& p : point) depth += (p.sigma_a + p.sigma_s) * (end / steps);
  }
  test::Moments T[3], emitted[3], scattered[3], in_flight[3], glow[3];
  const auto weigh = [](float t) { return 1 + std::sin(2 * t); };
  for (int i = 0; i < 100000; ++i) {
    const MediumCrossing found = medium.cross(through, end, RGB(1), hash(i), true);
    const MediumSample flight = medium.sample(through, end, RGB(1), hash(i, 9));
    for (int c = 0; c < 3; ++c) {
      T[c].add(found.transmittance[c]), emitted[c].add(found.emitted[c]), glow[c].add(flight.emitted[c]);
      scattered[c].add(found.scattering.weight[c] * weigh(found.scattering.t));
      in_flight[c].add(flight.scattered ? flight.weight[c] * weigh(flight.t) : 0.0f);
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double expected = std::exp(-double(depth[c]));
    EXPECT_NEAR(T[c].mean(), expected, 0.01 * expected) << c;
    EXPECT_LT(std::sqrt(T[c].variance()), 0.12 * expected) << c;
    const auto agree = [&](const test::Moments& a, const test::Moments& b) {
      const double error = std::sqrt((a.variance() + b.variance()) / 100000) * 4 + 0.01 * b.mean();
      EXPECT_NEAR(a.mean(), b.mean(), error) << c;
      EXPECT_LT(error, 0.05 * b.mean());
    };
    if (c != 1) agree(emitted[c], glow[c]);
    agree(scattered[c], in_flight[c]);
  }
}

// Expectation: pieces follow each other, within the ray, not where nothing is, cut where asked; each knows a point of
// itself; a ray beside the medium has none.
TEST(UnevenMedium, CutsRaysIntoStrata) {
  const GridMedium medium = clumps(RGB(0.1f), RGB(1), RGB());
  RayStrata s;
  const float also[] = {-1, 2.5f, 3.75f, 100};
  medium.stratify(through, 7, 5, also, &s);
  ASSERT_GT(s.count, UnevenMedium::least_strata);
  int cut = 0;
  float length = 0;
  for (int i = 0; i < s.count; ++i) {
    EXPECT_TRUE(s.begin[i] < s.end[i] && s.begin[i] <= s.at[i] && s.at[i] <= s.end[i] && s.end[i] <= 7);
    if (i > 0) {
      EXPECT_GE(s.begin[i], s.end[i - 1]);
    }
    cut += s.end[i] == 2.5f || s.end[i] == 3.75f;
    length += s.length(i);
  }
  EXPECT_EQ(cut, 2);
  EXPECT_LT(length, s.end[s.count - 1] - s.begin[0]) << "there are gaps";
  medium.stratify({.o = through.o, .d = -through.d}, infinity, 5, also, &s);
  EXPECT_EQ(s.count, 0);
}

}  // namespace
}  // namespace dapple::media
