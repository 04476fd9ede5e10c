// SPDX-License-Identifier: Apache-2.0
// What hides parts of the radiosity cache's cells from all that read them.
#include <gtest/gtest.h>

#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

struct PanelCase {
  const char *name, *light, *panel;
  float allowed;
};
void PrintTo(const PanelCase& c, std::ostream* os) {
  *os << c.name;
}

class PanelsBeforeAWall : public testing::TestWithParam<PanelCase> {};

// Panels 2 cm in front of a wall hide a third of it: pictures, or windows of a house at night. No ray sees the wall
// behind them, but cells are wider than they are. Seen, in the light that the wall sends on: -5 % behind pictures,
// which are black, and +4 % behind lamps, which shine on the wall too; -28 and +24 % where cells' rays start behind
// them as well.
TEST_P(PanelsBeforeAWall, HidePartsOfCells) {
  std::string text = R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "box"
LookAt -1.9 1.2 0  2 1.2 0  0 1 0
Camera "perspective" "float fov" 70
WorldBegin
)" + std::string(GetParam().light) +
                     R"(
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
)";
  for (const std::string& side : {test::wall({-2, 0, 2}, {2, 0, 2}, {-2, 0, -2}, {2, 0, -2}),
                                  test::wall({-2, 2.5f, -2}, {2, 2.5f, -2}, {-2, 2.5f, 2}, {2, 2.5f, 2}),
                                  test::wall({-2, 0, -2}, {2, 0, -2}, {-2, 2.5f, -2}, {2, 2.5f, -2}),
                                  test::wall({2, 0, 2}, {-2, 0, 2}, {2, 2.5f, 2}, {-2, 2.5f, 2}),
                                  test::wall({-2, 0, 2}, {-2, 0, -2}, {-2, 2.5f, 2}, {-2, 2.5f, -2}),
                                  test::wall({2, 0, -2}, {2, 0, 2}, {2, 2.5f, -2}, {2, 2.5f, 2})})
    text += side;
  text += std::string(GetParam().panel) + "\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n";
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 4; ++j) {
      const float z = -1.4f + 0.5f * float(i), y = 0.4f + 0.5f * float(j);
      text += test::wall({-1.98f, y, z + 0.3f}, {-1.98f, y, z}, {-1.98f, y + 0.3f, z + 0.3f}, {-1.98f, y + 0.3f, z});
    }
  const auto built = test::build_text(text);
  const RGB expected = test::render_built(built, 2048, test::bounces(2, 8)).mean();
  distribution::DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  s.shading.shadow_rays = integrate::RayList{4, 2};
  s.shading.diffuse_rays = integrate::RayList{16, 4};
  RGB there;
  constexpr int seeds = 4;
  for (int seed = 0; seed < seeds; ++seed) {
    s.shading.seed = uint64_t(seed);
    there += test::render_built(built, 8, s).mean() * (1.0f / seeds);
  }
  test::expect_near(there, expected, GetParam().allowed, "panels");
}
INSTANTIATE_TEST_SUITE_P(
    RadiosityCacheBreakers, PanelsBeforeAWall,
    testing::Values(PanelCase{"pictures", R"(LightSource "spot" "point3 from" [ -.5 1.2 0 ] "point3 to" [ -2 1.2 0 ]
  "float coneangle" 40 "float conedeltaangle" 5 "rgb I" [ 10 10 10 ])",
                              "", 0.08f},
                    PanelCase{"lamps", "", R"(AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] "bool twosided" true)",
                              0.07f}),
    [](const auto& of) { return of.param.name; });

// The sun shines into a corridor with a bend, and the eye is where it ends. What is seen reads cells of the walls at
// the bend and around it, whose brighter parts it does not see, and these do the same: 16 % too bright, where wide
// cells are read by any number.
TEST(RadiosityCacheBreakers, AroundABend) {
  std::string text = R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 27
LookAt -7 7 1.4  -7 2 1.1  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
LightSource "distant" "rgb L" [ 20 19 17 ] "point3 from" [ 4 1 3 ] "point3 to" [ 0 1 .2 ]
LightSource "infinite" "rgb L" [ .3 .4 .6 ]
Material "diffuse" "rgb reflectance" [ .7 .68 .65 ]
)";
  const float high = 2.4f;
  const V2f feet[][2] = {
      {{0, 0}, {-8, 0}}, {{0, 2}, {-6, 2}}, {{-8, 0}, {-8, 8}}, {{-6, 2}, {-6, 8}}, {{-8, 8}, {-6, 8}}};
  for (const auto& [a, b] : feet) text += test::wall({a.x, a.y, 0}, {b.x, b.y, 0}, {a.x, a.y, high}, {b.x, b.y, high});
  for (const float z : {0.0f, high}) {
    text += test::wall({-8, 0, z}, {0, 0, z}, {-8, 2, z}, {0, 2, z});
    text += test::wall({-8, 2, z}, {-6, 2, z}, {-8, 8, z}, {-6, 8, z});
  }
  const auto built = test::build_text(text);
  const RGB expected = test::render_built(built, 4096, test::bounces(4, 8)).mean();
  distribution::DistributionIntegrator::Settings s;
  s.visible_points = distribution::VisiblePoints::samples;
  s.shading.bounces = 4;
  s.shading.shadow_rays = integrate::RayList{16, 4, 1};
  s.shading.diffuse_rays = integrate::RayList{64, 4, 1};
  RGB there;
  constexpr int seeds = 8;
  for (int seed = 0; seed < seeds; ++seed) {
    s.shading.seed = uint64_t(seed);
    there += test::render_built(built, 256, s).mean() * (1.0f / seeds);
  }
  test::expect_near(there, expected, 0.07f, "around the bend");
}

}  // namespace
}  // namespace dapple
