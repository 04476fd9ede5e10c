// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/ground_visibility.h"

#include <gtest/gtest.h>

namespace dapple::forest {
namespace {

constexpr V3f up{0, 0, 1};

/// Answers everything.
class Half final : public emitters::Visibility {
 public:
  bool answers(const V3f&, const V3f&, const V3f&) const override { return true; }
  void visible(const emitters::ShadowRays& rays, RGB* visible) const override {
    for (int i = 0; i < rays.count; ++i) visible[i] = RGB(0.5f + rays.P[i].x);
  }
};

/// 4 m by 2 m about the origin, rising by .1 a metre; the sun in the zenith, the sky brighter to the right.
GroundLight plot() {
  GroundLight g;
  g.area = {{-2, -1}, {2, 1}};
  g.tolerance = 0.01f;
  g.eye = {0, 0, 100};
  g.nearest = 1;
  g.height = Raster(40, 20, 1);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 40; ++x) g.height.row(0, y)[x] = 0.1f * ((float(x) + 0.5f) / 10 - 2);
  g.beams.push_back({up, 0.999f, Raster(1, 1, 3)});
  for (int c = 0; c < 3; ++c) g.beams[0].share.row(c, 0)[0] = 0.2f * float(c);
  g.sky = Raster(2, 1, 1);
  g.sky.values = {0, 1};
  return g;
}

// Rationale: maps of the same rectangle are read between the middles of their own pixels, whatever their number.
// Expectation: closed forms; the rest of a batch, in any order, is another's.
TEST(GroundVisibility, ReadsItsMapsAndLeavesTheRest) {
  const GroundVisibility g(plot(), std::make_shared<Half>());
  const V3f aside = normalize(V3f(1, 0, 1));
  emitters::ShadowRays rays;
  const auto add = [&](const V3f& P, const V3f& n, const V3f& d) {
    const int i = rays.count++;
    rays.P[i] = P, rays.Ng[i] = n, rays.d[i] = d, rays.key[i] = 0;
  };
  add({0, 0, 0}, up, up);
  add({0, 0, 0.5f}, up, up);      // above the ground
  add({0, 0.3f, 0}, -up, aside);  // between the sky's two pixels
  add({0, 0, 0}, {1, 0, 0}, up);  // upright
  add({0.5f, 0, 0.05f}, normalize(V3f(-0.1f, 0, 1)), aside);
  add({3, 0, 0.3f}, up, up);         // beside the plot
  add({1.5f, 0, 0.15f}, up, aside);  // beyond the middle of the sky's last pixel
  RGB visible[7];
  g.visible(rays, visible);
  const RGB expected[] = {{0, 0.2f, 0.4f}, RGB(0.5f), RGB(0.5f), RGB(0.5f), RGB(0.75f), RGB(3.5f), RGB(1)};
  for (int i = 0; i < rays.count; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(visible[i][c], expected[i][c], 1e-5f) << i;
}

TEST(GroundVisibility, AnswersForKnownLightsOnFarGround) {
  GroundLight light = plot();
  const V3f origin(0, 0, 0);
  EXPECT_TRUE(GroundVisibility(light, nullptr).answers(origin, up, up));
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers(origin, up, {0, 0, -1}));
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers(origin, origin, up)) << "in media";
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers({0, 0, 0.5f}, up, up));
  light.beams[0].share = {};
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers(origin, up, up)) << "a sun is not the sky";
  EXPECT_FALSE(light.empty());
  light.eye = {0, 0, 0.5f};
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers(origin, up, {0.6f, 0, 0.8f})) << "near";
  light.height.row(0, 10)[20] = std::nanf(""), light.eye.z = 9;
  EXPECT_FALSE(GroundVisibility(light, nullptr).answers(origin, up, {0.6f, 0, 0.8f})) << "no ground";
  light.sky = {};
  EXPECT_TRUE(light.empty());
  EXPECT_FALSE(GroundVisibility({}, nullptr).answers(origin, up, up));
}

}  // namespace
}  // namespace dapple::forest
