// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/phase_function.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/media/cloud_density.h"
#include "dapple/numeric/warp.h"
#include "tests/support/chi_square.h"

namespace dapple::media {
namespace {

TEST(HenyeyGreenstein, SamplesFollowTheDensityAndTheMeanCosineIsG) {
  const V3f wo = normalize(V3f(1, -2, 0.5f));
  for (const float g : {-0.9f, -0.3f, 0.0f, 5e-4f, 0.5f, 0.85f}) {
    const HenyeyGreenstein phase{g};
    test::Moments cosine;
    const auto result = test::chi_square_sphere(
        [&](KeyedRng& rng) -> std::optional<V3f> {
          V3f wi;
          const V2f u(rng.next(), rng.next());
          const float pdf = phase.sample(wo, u, &wi);
          EXPECT_NEAR(pdf / phase.eval(wo, wi), 1, 1e-4f);
          cosine.add(-dot(wo, wi));
          return wi;
        },
        [&](const V3f& w) { return phase.eval(wo, w); });
    EXPECT_GT(result.p_value, test::sidak(0.01, 6)) << g << " " << result.message;
    EXPECT_GT(test::z_test(cosine, g, 1e-5), test::sidak(0.01, 6)) << g;
  }
}

// Full at the bottom, nothing at the top, less and less in between; and the same
// through a transform.
TEST(CloudDensity, ThinsOutUpwards) {
  KeyedRng rng(2);
  double low = 0, high = 0;
  constexpr int n = 2000;
  for (int i = 0; i < n; ++i) {
    const float x = rng.next(), z = rng.next();
    EXPECT_EQ(cloud_density(V3f(x, -0.1f, z), 1, 1, 5), 1);
    EXPECT_EQ(cloud_density(V3f(x, 1, z), 1, 1, 5), 0);
    const float a = cloud_density(V3f(x, 0.55f, z), 1, 1, 5), b = cloud_density(V3f(x, 0.9f, z), 1, 1, 5);
    EXPECT_TRUE(a >= 0 && a <= 1);
    low += double(a), high += double(b);
  }
  EXPECT_GT(low / n, 3 * high / n);
  pattern::ShadingPoints points;
  points.count = 1;
  points.P.set(0, V3f(2.4f, 1.1f, 0.6f));
  float value;
  CloudDensity(Transform::scale({0.5f, 0.5f, 0.5f}), 1, 1, 5).evaluate(points, &value);
  EXPECT_EQ(value, cloud_density(V3f(1.2f, 0.55f, 0.3f), 1, 1, 5));
}

}  // namespace
}  // namespace dapple::media
