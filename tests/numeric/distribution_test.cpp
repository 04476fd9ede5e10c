// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/distribution.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfloat>
#include <numeric>

#include "tests/support/chi_square.h"

namespace dapple {
namespace {

const float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<float> random_weights(size_t n, uint64_t key) {
  std::vector<float> w;
  KeyedRng rng(key);
  for (size_t i = 0; i < n; ++i) {
    const float r = rng.next();
    w.push_back(r < 0.2f ? 0 : r * r * r);
  }
  return w;
}

TEST(Distribution1D, ProbabilitiesAreTheWeightsWithinTheirGrid) {
  const std::vector<float> w = {1, 0, 3, 4, 0, 0, 2};
  const Distribution1D d(w);
  EXPECT_EQ(d.size(), 7);
  EXPECT_DOUBLE_EQ(d.sum(), 10);
  EXPECT_DOUBLE_EQ(d.integral(), 10.0 / 7);
  double sum = 0;
  for (int i = 0; i < 7; ++i) {
    EXPECT_NEAR(d.probability(i), w[static_cast<size_t>(i)] / 10, 4 * 0x1p-24);
    EXPECT_EQ(d.probability(i) == 0, w[static_cast<size_t>(i)] == 0);
    EXPECT_EQ(d.pdf((static_cast<float>(i) + 0.5f) / 7), d.probability(i) * 7);
    sum += d.probability(i);
  }
  EXPECT_EQ(sum, 1);  // exactly
}

// The claim that makes estimators unbiased: over all 2^24 values of u, each cell is drawn exactly as often as it says.
TEST(Distribution1D, TheSamplerIsExact) {
  const std::vector<float> w = {1e-12f, 5, 0, 1, 1e-3f, 0, 1e6f, 0.3f};
  const Distribution1D d(w);
  std::vector<int> counts(w.size(), 0);
  for (int i = 0; i < 1 << 24; ++i)
    ++counts[static_cast<size_t>(d.sample_discrete(static_cast<float>(i) * 0x1p-24f).index)];
  for (size_t i = 0; i < w.size(); ++i) {
    EXPECT_EQ(static_cast<float>(counts[i]) * 0x1p-24f, d.probability(static_cast<int>(i))) << i;
    EXPECT_EQ(counts[i] > 0, w[i] > 0) << i;
  }
}

TEST(Distribution1D, SampleAndPdfAndInverseAgree) {
  for (const size_t n : {1, 2, 3, 7, 100, 1023, 4096}) {
    const Distribution1D d(random_weights(n, n));
    KeyedRng rng(n);
    for (int i = 0; i < 3000; ++i) {
      const float u = i == 0 ? 0 : i == 1 ? one_minus_epsilon : rng.next();
      const Distribution1D::Sample s = d.sample(u);
      ASSERT_TRUE(s.x >= 0 && s.x < 1);
      ASSERT_GT(s.pdf, 0);
      ASSERT_EQ(d.pdf(s.x), s.pdf);
      ASSERT_NEAR(d.invert(s.x), u, 1e-6f + 2e-7f * static_cast<float>(n) / std::min(1.0f, s.pdf)) << n;
      const Distribution1D::Choice c = d.sample_discrete(u);
      ASSERT_EQ(c.index, s.index);
      ASSERT_TRUE(c.u >= 0 && c.u < 1);
    }
  }
}

TEST(Distribution1D, NoWeightMeansUniformAndIsReported) {
  for (const std::vector<float>& w : {std::vector<float>{}, {0, 0, 0}, {nan, -1, 0}}) {
    const Distribution1D d(w);
    EXPECT_TRUE(d.is_zero());
    EXPECT_EQ(d.integral(), 0);
    EXPECT_NEAR(d.sample(0.5f).x, 0.5f, 1e-6f);
    EXPECT_NEAR(d.pdf(0.3f), 1, 1e-6f);
  }
}

TEST(Distribution1D, UnusableWeightsCountAsZeroOrHuge) {
  const std::vector<float> w = {nan, 1, -5, infinity, FLT_MAX, -infinity};
  const Distribution1D d(w);
  EXPECT_TRUE(std::isfinite(d.sum()));
  EXPECT_EQ(d.probability(0), 0);
  EXPECT_GT(d.probability(1), 0);  // 1 against FLT_MAX, yet reachable
  EXPECT_EQ(d.probability(2), 0);
  EXPECT_NEAR(d.probability(3), 0.5f, 1e-6f);
  EXPECT_NEAR(d.probability(4), 0.5f, 1e-6f);
  EXPECT_EQ(d.probability(5), 0);
  for (const float u : {0.0f, 0.25f, one_minus_epsilon, 1.0f, -1.0f}) EXPECT_TRUE(std::isfinite(d.sample(u).x));
  EXPECT_EQ(d.pdf(nan), 0);
  EXPECT_EQ(d.pdf(1), 0);
  EXPECT_EQ(d.pdf(-1e-9f), 0);
  EXPECT_TRUE(std::isfinite(d.invert(2)));
}

TEST(Distribution1D, RefusesMoreCellsThanTheGridCanTell) {
  EXPECT_THROW(Distribution1D(std::vector<float>(Distribution1D::max_size + 1, 1.0f)), std::length_error);
}

TEST(Distribution2D, SamplesFollowThePdf) {
  for (const auto& [nx, ny] : {std::pair(1, 1), {8, 4}, {5, 7}, {31, 17}}) {
    std::vector<float> w = random_weights(static_cast<size_t>(nx * ny), 3);
    if (ny > 4) std::fill_n(w.begin() + 2 * nx, nx, 0.0f);  // a zero row
    w[0] = 20;                                              // and a bright cell
    const Distribution2D d(w, nx, ny);
    const auto result = test::chi_square_square(
        [&](KeyedRng& rng) {
          const float u = rng.next();
          return d.sample({u, rng.next()}).p;
        },
        [&](const V2f& p) { return d.pdf(p); }, {.cells_x = nx, .cells_y = ny});
    EXPECT_GT(result.p_value, test::sidak(0.01, 4)) << nx << " x " << ny << ": " << result.message;
    EXPECT_NEAR(result.integral, 1, 1e-5);
  }
}

TEST(Distribution2D, SamplesDrawnTogetherAreThoseDrawnSingly) {
  for (const auto& [nx, ny] : {std::pair(1, 1), {300, 4}, {1000, 7}}) {
    std::vector<float> w = random_weights(static_cast<size_t>(nx * ny), 3);
    w[w.size() / 3] = 1e6f;
    const Distribution2D d(w, nx, ny);
    std::vector<V2f> u;
    for (int i = 0; i < 1000; ++i) u.push_back({to_unit_float(hash(i, 1)), to_unit_float(hash(i, 2))});
    for (const size_t n : {0, 1, 15, 16, 17, 1000}) {
      std::vector<Distribution2D::Sample> together(n);
      d.sample(std::span(u).first(n), together.data());
      for (size_t i = 0; i < n; ++i) {
        const Distribution2D::Sample alone = d.sample(u[i]);
        ASSERT_EQ(together[i].p, alone.p);
        ASSERT_EQ(together[i].pdf, alone.pdf);
        ASSERT_EQ(std::pair(together[i].x, together[i].y), std::pair(alone.x, alone.y));
      }
    }
  }
}

TEST(Distribution2D, PdfIsTheFunctionOverItsIntegral) {
  const int nx = 16, ny = 9;
  const std::vector<float> w = random_weights(nx * ny, 5);
  const Distribution2D d(w, nx, ny);
  EXPECT_NEAR(d.integral(), std::accumulate(w.begin(), w.end(), 0.0) / (nx * ny), 1e-9);
  KeyedRng rng(1);
  for (int i = 0; i < 5000; ++i) {
    const float u = rng.next();
    const V2f uv(u, rng.next());
    const Distribution2D::Sample s = d.sample(uv);
    ASSERT_EQ(d.pdf(s.p), s.pdf);
    ASSERT_NEAR(s.pdf, w[static_cast<size_t>(s.y * nx + s.x)] / d.integral(), 1e-4 * s.pdf + 1e-4);
    const V2f back = d.invert(s.p);
    ASSERT_NEAR(back.x, uv.x, 1e-3);
    ASSERT_NEAR(back.y, uv.y, 1e-3);
  }
}

TEST(Distribution2D, NeverDrawsZeroCells) {
  std::vector<float> w(64 * 64, 0.0f);
  w[64 * 10 + 63] = 1e-30f;
  w[64 * 63 + 5] = 1e30f;
  const Distribution2D d(w, 64, 64);
  KeyedRng rng(4);
  for (int i = 0; i < 20000; ++i) {
    const float u = rng.next();
    const auto s = d.sample({u, rng.next()});
    ASSERT_GT(w[static_cast<size_t>(s.y * 64 + s.x)], 0);
  }
  EXPECT_GT(d.pdf({63.5f / 64, 10.5f / 64}), 0);  // reachable all the same
}

TEST(Distribution2D, RowsAreAskedForOnceEachAndMemoryIsLittleMoreThanAWordACell) {
  std::vector<std::atomic<int>> asked(256);
  const Distribution2D d(512, 256, [&](int y, std::span<float> row) {
    ++asked[static_cast<size_t>(y)];
    std::fill(row.begin(), row.end(), 1.0f);
  });
  for (const auto& a : asked) EXPECT_EQ(a, 1);
  EXPECT_LE(d.bytes(), 512 * 256 * 4.5 * 1.02);
  EXPECT_NEAR(d.pdf({0.3f, 0.9f}), 1, 1e-3);
}

TEST(Distribution2D, BlackIsUniformAndReported) {
  const Distribution2D d(std::vector<float>(12, 0.0f), 4, 3);
  EXPECT_TRUE(d.is_zero());
  EXPECT_NEAR(d.sample({0.5f, 0.25f}).pdf, 1, 1e-5);
  EXPECT_THROW(Distribution2D(std::vector<float>(11, 1.0f), 4, 3), std::length_error);
  EXPECT_THROW(Distribution2D(std::vector<float>(), 0, 3), std::length_error);
}

}  // namespace
}  // namespace dapple
