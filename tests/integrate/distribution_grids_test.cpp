// SPDX-License-Identifier: Apache-2.0
// Shading grids against themselves: what is shaded how often, and by whom.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/numeric/warp.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using shading::Stage;
using test::build_text;
using test::expect_near;
using test::film;
using test::furnished_room;
using test::render_built;
using test::render_text;
using test::same_bits;
using test::uncached;

TEST(DistributionGrids, OfAnyNumberOfThreadsAndAnyBudgetAreTheSame) {
  const auto built =
      build_text(furnished_room(R"(Material "coateddiffuse" "texture reflectance" "checks" "float roughness" 0)"));
  auto s = uncached(1, {2}, {3});
  const auto whole = render_built(built, 4, s);
  set_thread_count(1);
  const auto alone = render_built(built, 4, s);
  s.grid_bytes = 0;
  const auto unkept = render_built(built, 4, s);
  set_thread_count(0);
  s.grid_bytes = 100000;
  const auto few = render_built(built, 4, s);
  EXPECT_TRUE(same_bits(whole.film, alone.film));
  EXPECT_TRUE(same_bits(whole.film, unkept.film));
  EXPECT_TRUE(same_bits(whole.film, few.film));
  EXPECT_GT(unkept.result.stages[Stage::prelighting], whole.result.stages[Stage::prelighting]);
}

// Meshes much finer than a pixel, by one point for a group: leaves that turn anywhere, lit from the viewer, and a
// flattened instance of a bumpy sheet. Shading one side for the other, or groups of the wrong size, would be wrong by
// tens of per cent.
TEST(DistributionGroups, LookLikeTheirPatches) {
  std::string leaves, sheet, indices;
  KeyedRng rng(1);
  const auto number = [&](float low, float high) { return std::to_string(low + (high - low) * rng.next()) + " "; };
  const auto triple = [](const V3f& p) {
    return std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
  };
  for (int leaf = 0; leaf < 4000; ++leaf) {
    const V3f n = normalize(square_to_sphere(V2f(rng.next(), rng.next())));
    V3f s, t;
    coordinate_system(n, &s, &t);
    const V3f c(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    for (const V2f& q : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)})
      leaves += triple(c + (s * q.x + t * q.y) * 0.012f);
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * leaf + v) + " ";
  }
  const std::string head = film(20) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.8 .8 -.8 .8 ]
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)";
  const auto compare = [&](const std::string& shapes, float tolerance, const std::string& what) {
    const auto built = build_text(head + shapes);
    auto s = uncached(0, {1}, {1});
    s.shading_rate = 4;
    expect_near(render_built(built, 64, s).mean(), render_built(built, 256, test::bounces(0)).mean(), tolerance, what);
  };
  // Which leaf stands for many is not which of them is seen most: some per cent.
  compare("Shape \"bilinearmesh\" \"point3 P\" [ " + leaves + "] \"integer indices\" [ " + indices + "]", .1f,
          "leaves");
  std::string grid, quads;
  constexpr int n = 60;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      grid += std::to_string(2.0f * float(i) / n - 1) + " " + std::to_string(2.0f * float(j) / n - 1) + " " +
              number(0, .01f);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      for (const int v : {j * (n + 1) + i, j * (n + 1) + i + 1, (j + 1) * (n + 1) + i, (j + 1) * (n + 1) + i + 1})
        quads += std::to_string(v) + " ";
  const std::string mesh = "Shape \"bilinearmesh\" \"point3 P\" [ " + grid + "] \"integer indices\" [ " + quads + "]\n";
  compare("ObjectBegin \"s\"\n" + mesh + "ObjectEnd\nScale 1 1 1e-4\nObjectInstance \"s\"", .01f, "flattened");
  compare(mesh, .02f, "sheet");
}

// Of a patch of four by four points three columns are behind another one: these are shaded as far as what is seen lies
// between them and the fourth.
TEST(DistributionGrids, OfSmallPatchesOnlyWhatIsSeenIsShaded) {
  const auto points = [](const std::string& shapes) {
    const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -4 4 -4 4 ]
WorldBegin
LightSource "infinite"
Material "diffuse"
)" + shapes);
    return render_built(built, 64, uncached(0, {1}, {1})).result.stages[Stage::prelighting];
  };
  const std::string small = "Shape \"bilinearmesh\" \"point3 P\" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]\n";
  const std::string large = "Shape \"bilinearmesh\" \"point3 P\" [ -19 -16 1  13 -16 1  -19 16 1  13 16 1 ]\n";
  const std::string cover = "Translate -12 0 0\n" + large;
  EXPECT_EQ(points(small), 16u);
  EXPECT_EQ(points(small + cover) - points(cover), 8u);
}

// Leaves with sides of .1 in a box of 2: a mesh of quads.
std::string cloud_of_leaves(int count) {
  std::string leaves, indices;
  KeyedRng rng(2);
  for (int leaf = 0; leaf < count; ++leaf) {
    const V3f n = normalize(square_to_sphere(V2f(rng.next(), rng.next())));
    V3f s, t;
    coordinate_system(n, &s, &t);
    const V3f c(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    for (const V2f& q : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)})
      for (int axis = 0; axis < 3; ++axis) leaves += std::to_string((c + (s * q.x + t * q.y) * 0.05f)[axis]) + " ";
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * leaf + v) + " ";
  }
  return "Shape \"bilinearmesh\" \"point3 P\" [ " + leaves + "] \"integer indices\" [ " + indices + "]\n";
}

// Hundreds of leaves in a pixel: only those that its first samples see, two sides of them, are shaded, whatever the
// number of samples; the image's mean stays, and it does not depend on threads or on what the store of grids forgets.
TEST(DistributionGroups, OfAPixelAreShadedFewTimes) {
  const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.8 .8 -.8 .8 ]
WorldBegin
LightSource "distant" "point3 from" [ 1 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)" + cloud_of_leaves(3000));
  auto s = uncached(0, {1}, {1});
  s.pixel_points = 0;
  const auto all = render_built(built, 256, s);
  s.pixel_points = 4;
  const auto few = render_built(built, 256, s);
  const uint64_t pixels = 64;
  EXPECT_GT(all.result.stages[Stage::prelighting], 10 * pixels);
  EXPECT_LT(few.result.stages[Stage::prelighting], 6 * pixels);
  // A few dark or bright leaves of about 4 x 64 change it by some per cent.
  expect_near(few.mean(), all.mean(), .05f, "four points");
  // As many as there are: what stands for others are all that the pixel sees.
  s.pixel_points = 128;
  expect_near(render_built(built, 256, s).mean(), all.mean(), .01f, "128 points");

  s.pixel_points = 4;
  s.grid_bytes = 0;
  set_thread_count(1);
  const auto again = render_built(built, 256, s);
  set_thread_count(0);
  EXPECT_TRUE(same_bits(few.film, again.film));
}

// The leaves of a pixel send between them about as many rays as the one point of a wall would; those that are larger
// than pixels send all of them.
TEST(DistributionGroups, OfAPixelShareItsRays) {
  const auto render = [](const std::string& half, int pixel_points) {
    const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ )" +
                                  "-" + half + " " + half + " -" + half + " " + half + R"( ]
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)" + cloud_of_leaves(3000));
    auto s = uncached(0, {64}, {1});
    s.pixel_points = pixel_points;
    return render_built(built, 64, s);
  };
  const uint64_t pixels = 64;
  const auto points = [](const auto& r) { return r.result.stages[Stage::prelighting]; };
  const auto many = render(".8", 16), one = render(".8", 1), close = render(".1", 16);
  EXPECT_GT(points(many), 8 * pixels);
  EXPECT_LT(many.result.rays.shadow, 2 * 64 * pixels);
  EXPECT_GT(many.result.rays.shadow, 64 * pixels / 2);
  EXPECT_EQ(one.result.rays.shadow, 64 * points(one));
  EXPECT_GT(close.result.rays.shadow, 64 * points(close) / 2);
  expect_near(many.mean(), one.mean(), .05f, "sixteen points, and one");
}

// A wall that fills the image has no silhouette at which more samples could find more: 4 x 4 tiles of cells one pixel
// large.
TEST(DistributionGrids, AreShadedOnceHoweverManySamplesSeeThem) {
  const std::string scene = film(64) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ 0 0 1 ]
Material "diffuse"
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)";
  const auto few = render_text(scene, 4, uncached(0, {1}, {1})), many = render_text(scene, 64, uncached(0, {1}, {1}));
  EXPECT_EQ(few.result.stages[Stage::prelighting], 64u * 64u);
  EXPECT_EQ(many.result.stages[Stage::prelighting], 64u * 64u);
  auto coarse = uncached(0, {1}, {1});
  coarse.shading_rate = 16;
  EXPECT_EQ(render_text(scene, 4, coarse).result.stages[Stage::prelighting], 16u * 16u);
}

// Slats much narrower than a pixel: each sample finds a few that none before it met. Expectation: their patterned
// shader runs in batches of 256 all the same, but for one in each of the seven passes and one where a list is full; by
// sample and block of pixels it would be hundreds.
TEST(DistributionGrids, OfManySamplesAreShadedInFullBatches) {
  std::string slats, indices;
  for (int i = 0; i < 3000; ++i) {
    const double x = -1 + 2 * i / 3000.0;
    for (const char* end : {" -1 0 ", " 1 0 "}) slats += std::to_string(x) + end + std::to_string(x + 0.5 / 3000) + end;
    for (int c = 0; c < 4; ++c) indices += std::to_string(4 * i + c) + " ";
  }
  const auto built = build_text(film(64) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ 0 0 1 ]
Texture "noise" "float" "fbm"
Texture "color" "spectrum" "scale" "texture scale" "noise" "rgb tex" [ .5 .5 .5 ]
Material "diffuse" "texture reflectance" "color"
Shape "bilinearmesh" "integer indices" [ )" +
                                indices + "] \"point3 P\" [ " + slats + "]\n");
  auto s = uncached(0, {1}, {1});
  s.pixel_points = 0;
  set_thread_count(1);
  const auto r = render_built(built, 64, s);
  set_thread_count(0);
  const uint64_t points = r.result.stages[Stage::prelighting];
  EXPECT_GT(points, 20000u);
  EXPECT_LE(r.result.stages.batches, points / 240 + 30);
}

// One thread has claimed all points and put them off, for want of a full batch, and is not called again: what another
// thread renders of the same points must not wait for it, however much there is.
TEST(DistributionGrids, ThatAnIdleThreadHasClaimedAreShadedByWhoNeedsThem) {
  const auto built = build_text(film(16) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3.14159265 3.14159265 3.14159265 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)");
  const DistributionIntegrator integrator(*built.scene, uncached(0, {1}, {1}));
  std::unique_ptr<integrate::Integrator::Workspace> workspaces[] = {integrator.make_workspace(),
                                                                    integrator.make_workspace()};
  scene::Film image(built.scene->film);
  const Box2i all(V2i(0, 0), V2i(16, 16));
  integrator.render({all, 0, 1}, *workspaces[0], image);
  EXPECT_EQ(workspaces[0]->stages[Stage::prelighting], 0u) << "the test is to have points that are put off";
  integrator.render({all, 1, 64}, *workspaces[1], image);
  EXPECT_EQ(workspaces[1]->stages[Stage::prelighting], 16u * 16u);
  integrator.finish(workspaces, image);
  EXPECT_EQ(workspaces[0]->stages[Stage::prelighting], 0u);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      expect_near(image.pixel(x, y), RGB(.5f), 1e-5f, "pixel " + std::to_string(x) + ", " + std::to_string(y));
}

}  // namespace
}  // namespace dapple
