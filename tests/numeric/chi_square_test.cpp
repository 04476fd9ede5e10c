// SPDX-License-Identifier: Apache-2.0
#include "tests/support/chi_square.h"

#include <gtest/gtest.h>

#include "dapple/numeric/warp.h"

namespace dapple {
namespace {

V2f uniform2(KeyedRng& rng) {
  const float x = rng.next();
  return {x, rng.next()};
}

// Reference values: dof 2 is exp(-x/2); the others from tables of the chi-squared distribution's critical values.
TEST(ChiSquare, PValuesMatchTables) {
  for (const double x : {0.1, 1.0, 4.0, 30.0}) EXPECT_NEAR(test::chi_square_p(x, 2), std::exp(-x / 2), 1e-13);
  EXPECT_NEAR(test::chi_square_p(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(test::chi_square_p(18.307038053275146, 10), 0.05, 1e-12);
  EXPECT_NEAR(test::chi_square_p(135.80672317102676, 100), 0.01, 1e-12);
  EXPECT_NEAR(test::chi_square_p(1074.679446, 1000), 0.05, 1e-7);
  EXPECT_EQ(test::chi_square_p(0, 5), 1);
}

TEST(ChiSquare, SidakKeepsTheFamilyLevel) {
  EXPECT_NEAR(1 - std::pow(1 - test::sidak(0.05, 40), 40), 0.05, 1e-12);
  EXPECT_DOUBLE_EQ(test::sidak(0.01, 1), 0.01);
}

TEST(ChiSquare, AcceptsEveryWarp) {
  struct Case {
    const char* name;
    std::function<V3f(const V2f&)> warp;
    std::function<double(const V3f&)> pdf;
  };
  const float narrow = 1e-4f;
  const Case cases[] = {
      {"cosine", square_to_cosine_hemisphere, [](const V3f& w) { return cosine_hemisphere_pdf(w.z); }},
      {"sphere", square_to_sphere, [](const V3f&) { return sphere_pdf; }},
      {"hemisphere", square_to_hemisphere, [](const V3f& w) { return w.z >= 0 ? hemisphere_pdf : 0; }},
      {"cone", [](const V2f& u) { return square_to_cone(u, 0.3f); },
       [](const V3f& w) { return w.z >= 0.7f ? cone_pdf(0.3f) : 0; }},
      {"narrow cone", [=](const V2f& u) { return square_to_cone(u, narrow); },
       [=](const V3f& w) { return w.z >= 1 - narrow ? cone_pdf(narrow) : 0; }}};
  for (const Case& c : cases) {
    const auto result = test::chi_square_sphere([&](KeyedRng& rng) { return c.warp(uniform2(rng)); }, c.pdf);
    EXPECT_GT(result.p_value, test::sidak(0.01, std::size(cases))) << c.name << ": " << result.message;
  }
}

TEST(ChiSquare, RejectsAWrongDensity) {
  const auto cosine = [](KeyedRng& rng) { return square_to_cosine_hemisphere(uniform2(rng)); };
  EXPECT_LT(test::chi_square_sphere(cosine, [](const V3f& w) { return w.z >= 0 ? hemisphere_pdf : 0; }).p_value, 1e-6);
  // Five per cent more towards +x, of the same integral.
  EXPECT_LT(test::chi_square_sphere(cosine, [](const V3f& w) { return cosine_hemisphere_pdf(w.z) * (1 + 0.05 * w.x); })
                .p_value,
            1e-3);
  // The right shape, the wrong scale.
  EXPECT_EQ(test::chi_square_sphere(cosine, [](const V3f& w) { return 1.01 * cosine_hemisphere_pdf(w.z); }).p_value, 0);
  EXPECT_EQ(test::chi_square_sphere(cosine, [](const V3f&) { return std::nan(""); }).p_value, 0);
}

TEST(ChiSquare, RejectsSamplesWhereTheDensityIsZero) {
  const auto sample = [](KeyedRng& rng) {
    V3f w = square_to_cosine_hemisphere(uniform2(rng));
    if (rng.next() < 1e-3f) w.z = -w.z;
    return w;
  };
  EXPECT_EQ(test::chi_square_sphere(sample, [](const V3f& w) { return cosine_hemisphere_pdf(w.z); }).p_value, 0);
}

TEST(ChiSquare, RefusedSamplesAreMissingMass) {
  const auto sample = [](KeyedRng& rng) -> std::optional<V3f> {
    const V3f w = square_to_sphere(uniform2(rng));
    if (w.z < 0 && rng.next() < 0.5f) return std::nullopt;
    return w;
  };
  const auto right =
      test::chi_square_sphere(sample, [](const V3f& w) { return w.z < 0 ? sphere_pdf / 2 : sphere_pdf; });
  EXPECT_GT(right.p_value, 0.005) << right.message;
  EXPECT_EQ(test::chi_square_sphere(sample, [](const V3f&) { return sphere_pdf; }).p_value, 0);
}

// A lobe exp(kappa (cos - 1)) about a tilted axis, much narrower than a cell.
TEST(ChiSquare, IntegratesPeaks) {
  const double kappa = 3e3;
  const Frame frame(normalize(V3f(0.3f, -0.5f, 0.4f)));
  const auto sample = [&](KeyedRng& rng) {
    const V2f u = uniform2(rng);
    const double d = -std::log1p(-double(u.x) * (1 - std::exp(-2 * kappa))) / kappa;
    const double r = std::sqrt(std::max(0.0, d * (2 - d)));
    return frame.to_world(V3f(static_cast<float>(r * std::cos(2 * pi * u.y)),
                              static_cast<float>(r * std::sin(2 * pi * u.y)), static_cast<float>(1 - d)));
  };
  const auto pdf = [&](const V3f& w) {
    const V3f off = w - frame.n;  // 1 - cos without cancellation
    return kappa / (2 * std::numbers::pi) * std::exp(-kappa * length2(off) / 2);
  };
  const auto result = test::chi_square_sphere(sample, pdf, {.cells_x = 240, .cells_y = 120, .samples = 200000});
  EXPECT_GT(result.p_value, 0.005) << result.message;
  EXPECT_NEAR(result.integral, 1, 1e-4);
}

// Under a true hypothesis p-values are uniform, so few of 200 repetitions fall below 1 %.
TEST(ChiSquare, PValuesOfARightSamplerAreUniform) {
  std::vector<double> bins(10, 0.0), expected(10, 20.0);
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const auto result =
        test::chi_square_square([](KeyedRng& rng) { return uniform2(rng); }, [](const V2f&) { return 1.0; },
                                {.cells_x = 8, .cells_y = 8, .samples = 4000, .seed = seed});
    bins[static_cast<size_t>(std::min(result.p_value * 10, 9.0))] += 1;
  }
  EXPECT_GT(test::chi_square_counts(bins, expected).p_value, 0.005);
}

TEST(ZTest, TellsEqualFromDifferentMeans) {
  test::Moments a, b, c;
  KeyedRng rng(7);
  for (int i = 0; i < 20000; ++i) {
    a.add(rng.next());
    b.add(2 * sqr(rng.next()) - 1.0f / 6);  // mean 1/2, another variance
    c.add(rng.next() + 0.02);
  }
  EXPECT_NEAR(a.variance(), 1.0 / 12, 2e-3);
  EXPECT_GT(test::z_test(a, 0.5), 0.005);
  EXPECT_GT(test::z_test(a, b), 0.005);
  EXPECT_LT(test::z_test(a, c), 1e-6);
  EXPECT_LT(test::z_test(a, 0.52), 1e-6);
  EXPECT_EQ(test::z_test(a, a.mean() + 0.02, 0.021), 1);
}

}  // namespace
}  // namespace dapple
