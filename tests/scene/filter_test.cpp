// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/filter.h"

#include <gtest/gtest.h>

#include "dapple/numeric/sobol.h"

namespace dapple::scene {
namespace {

struct Case {
  const char* name;
  FilterKind kind;
  V2f radius;
  float a, b;
};

class Filters : public testing::TestWithParam<Case> {};

// Weighted samples must give the moments of the filter: E[w g(x)] / E[w] = integral(f g) / integral(f) for g = 1, x^2,
// cos.
TEST_P(Filters, WeightedSamplesHaveTheFiltersMoments) {
  const Case& c = GetParam();
  const Filter filter(c.kind, c.radius, c.a, c.b);
  const auto g = [&](const V2f& p) { return std::cos(1.3f * p.x) * std::cos(0.9f * p.y); };
  double sampled = 0, weights = 0;
  constexpr int n = 1 << 16;
  for (uint32_t i = 0; i < n; ++i) {
    const auto s = filter.sample(sample_2d(1, i, 0));
    EXPECT_LE(std::abs(s.offset.x), c.radius.x * 1.00001f);
    EXPECT_LE(std::abs(s.offset.y), c.radius.y * 1.00001f);
    sampled += double(s.weight * g(s.offset));
    weights += double(s.weight);
  }
  double exact = 0, total = 0;
  constexpr int m = 400;
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) {
      const V2f p((2 * (float(i) + .5f) / m - 1) * c.radius.x, (2 * (float(j) + .5f) / m - 1) * c.radius.y);
      exact += double(filter.evaluate(p) * g(p));
      total += double(filter.evaluate(p));
    }
  EXPECT_NEAR(sampled / weights, exact / total, 2e-3);
}

INSTANTIATE_TEST_SUITE_P(All, Filters,
                         testing::Values(Case{"box", FilterKind::box, {.5f, .7f}, 0, 0},
                                         Case{"triangle", FilterKind::triangle, {2, 1}, 0, 0},
                                         Case{"gaussian", FilterKind::gaussian, {1.5f, 1.5f}, .5f, 0},
                                         Case{"mitchell", FilterKind::mitchell, {2, 2}, 1.f / 3, 1.f / 3},
                                         Case{"sinc", FilterKind::sinc, {4, 3}, 3, 0}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace dapple::scene
