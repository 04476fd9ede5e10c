// SPDX-License-Identifier: Apache-2.0
// Light samples by what paths learned before rendering (docs/design/029): the same means, the same image for any
// threads, less noise.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/build/integrator_factory.h"
#include "tests/support/chi_square.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

constexpr const char* camera = R"(LookAt 1 -3 1.5  1.2 0 1.3  0 0 1
Camera "perspective" "float fov" 70
Film "rgb" "integer xresolution" 32 "integer yresolution" 24 "bool savefp16" false
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
)";

/// A rectangle from a corner, along two sides.
std::string rectangle(const V3f& p, const V3f& u, const V3f& v) {
  std::string points;
  for (const V3f& q : {p, p + u, p + u + v, p + v})
    points += std::to_string(q.x) + " " + std::to_string(q.y) + " " + std::to_string(q.z) + " ";
  return "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ " + points + "]\n";
}

std::string lamp(const V3f& p, float size, float L) {
  return "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ " + std::to_string(L) + " " + std::to_string(L) +
         " " + std::to_string(L) + " ]\n" + rectangle(p, V3f(0, size, 0), V3f(size, 0, 0)) + "AttributeEnd\n";
}

/// A room of 6 x 6 x 3 m whose wall at x = 3 has a window of a square metre, if `window`.
std::string room(bool window) {
  std::string text = rectangle(V3f(-3, -3.5f, 0), V3f(6, 0, 0), V3f(0, 6, 0)) +
                     rectangle(V3f(-3, -3.5f, 3), V3f(6, 0, 0), V3f(0, 6, 0)) +
                     rectangle(V3f(-3, -3.5f, 0), V3f(0, 6, 0), V3f(0, 0, 3)) +
                     rectangle(V3f(-3, -3.5f, 0), V3f(6, 0, 0), V3f(0, 0, 3)) +
                     rectangle(V3f(-3, 2.5f, 0), V3f(6, 0, 0), V3f(0, 0, 3));
  if (!window) return text + rectangle(V3f(3, -3.5f, 0), V3f(0, 6, 0), V3f(0, 0, 3));
  return text + rectangle(V3f(3, -3.5f, 0), V3f(0, 3, 0), V3f(0, 0, 3)) +
         rectangle(V3f(3, 0.5f, 0), V3f(0, 2, 0), V3f(0, 0, 3)) +
         rectangle(V3f(3, -0.5f, 0), V3f(0, 1, 0), V3f(0, 0, 1)) +
         rectangle(V3f(3, -0.5f, 2), V3f(0, 1, 0), V3f(0, 0, 1));
}

std::string window_room() {
  return camera +
         std::string(
             "LightSource \"infinite\" \"rgb L\" [ 2 2 2 ]\nLightSource \"distant\" \"rgb L\" [ 3 3 3 ] \"point3 "
             "from\" "
             "[ 2 0.1 0.8 ] \"point3 to\" [ 0 0 0 ]\n") +
         room(true);
}

/// Two lamps inside, and twelve brighter ones behind a wall.
std::string lamps_room() {
  std::string text = camera + room(false) + lamp(V3f(-1, 0, 2.9f), 0.3f, 8) + lamp(V3f(1, 0, 2.9f), 0.3f, 5);
  for (int i = 0; i < 12; ++i) text += lamp(V3f(3.5f + 0.5f * float(i / 4), -3 + 1.5f * float(i % 4), 2.9f), 0.3f, 20);
  return text;
}

/// A niche of 2 cm in the far wall, as deep, with a lamp that is seen from nowhere else.
std::string niche_room() {
  const float s = 0.05f;
  const V3f corner(1.2f, 2.5f, 1.3f);
  return camera + room(false) +
         lamp(V3f(-1, 0, 2.9f), 0.3f, 8) +  // the lamp of the niche shines into a box beside the room
         lamp(V3f(4, 0, 2.9f), 0.3f, 100) + rectangle(V3f(3.2f, -1, 0), V3f(2, 0, 0), V3f(0, 2, 0)) +
         rectangle(corner + V3f(0, -0.3f, s), V3f(s, 0, 0), V3f(0, 0.2f, 0)) +
         lamp(corner + V3f(0.01f, -0.25f, 0.9f * s), 0.03f, 900);
}

struct Means {
  test::Moments mean;
  double noise = 0;  // variance of a pixel, median over all: edges of lamps are noisy whatever is learned
};

// render(built, seed): a RenderedText.
template <class Render>
Means render_often(const build::BuiltScene& built, int seeds, const Render& render) {
  Means out;
  std::vector<test::Moments> pixels;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto r = render(built, uint64_t(seed));
    out.mean.add(r.mean().luminance());
    pixels.resize(size_t(r.film.width() * r.film.height()));
    for (int y = 0; y < r.film.height(); ++y)
      for (int x = 0; x < r.film.width(); ++x)
        pixels[size_t(y * r.film.width() + x)].add(double(r.film.pixel(x, y).luminance()));
  }
  std::vector<double> variances;
  for (const test::Moments& p : pixels) variances.push_back(p.variance());
  std::nth_element(variances.begin(), variances.begin() + std::ptrdiff_t(variances.size() / 2), variances.end());
  out.noise = variances[variances.size() / 2];
  return out;
}

Means render_paths(const std::string& text, int learning_paths, int seeds, int samples, int diffuse_bounces = 2) {
  return render_often(test::build_text(text), seeds, [&](const build::BuiltScene& built, uint64_t seed) {
    path::PathIntegrator::Settings s = test::bounces(diffuse_bounces);
    s.seed = seed + (learning_paths > 0 ? 1000 : 0);
    s.learning_paths = learning_paths;
    return test::render_built(built, samples, s);
  });
}

Means render_distribution(const std::string& text, int learning_paths, int seeds) {
  return render_often(test::build_text(text), seeds, [&](const build::BuiltScene& built, uint64_t seed) {
    distribution::DistributionIntegrator::Settings s;
    s.shading.bounces = 0;
    s.shading.seed = seed + (learning_paths > 0 ? 1000 : 0);
    path::PathIntegrator::Settings p = test::bounces(1);
    p.learning_paths = learning_paths;
    p.seed = s.shading.seed;
    s.shading.learned_lights = path::PathIntegrator(*built.scene, p).learned_lights();
    return test::render_built(built, 4, s);
  });
}

struct Case {
  const char* name;
  std::string (*text)();
  double least_gain;  // in variance of pixels, direct light alone
};

class Rooms : public testing::TestWithParam<Case> {};

// Three tests, together at 1 %.
TEST_P(Rooms, HaveTheSameMean) {
  const Means off = render_paths(GetParam().text(), 0, 24, 16), on = render_paths(GetParam().text(), 512, 24, 16);
  EXPECT_GT(test::z_test(on.mean, off.mean), test::sidak(0.01, 3)) << on.mean.mean() << " and " << off.mean.mean();
}

// The bounds are a third below what was measured, for want of seeds.
TEST_P(Rooms, HaveLessNoise) {
  const Means off = render_paths(GetParam().text(), 0, 8, 16, 0), on = render_paths(GetParam().text(), 1024, 8, 16, 0);
  EXPECT_GT(off.noise / on.noise, GetParam().least_gain);
}

TEST_P(Rooms, AreTheSameForAnyNumberOfThreads) {
  const build::BuiltScene built = test::build_text(GetParam().text());
  path::PathIntegrator::Settings s = test::bounces(2);
  s.learning_paths = 1024;
  const int before = thread_count();
  set_thread_count(1);
  const auto one = test::render_built(built, 2, s);
  set_thread_count(4);
  const auto four = test::render_built(built, 2, s);
  set_thread_count(before);
  EXPECT_TRUE(test::same_bits(one.film, four.film));
}

INSTANTIATE_TEST_SUITE_P(All, Rooms,
                         testing::Values(Case{"window", window_room, 1.5}, Case{"lamps", lamps_room, 2},
                                         Case{"niche", niche_room, 0.5}),
                         [](const auto& test) { return std::string(test.param.name); });

// A white box without a lid under a sky of radiance 1: light that comes back after any number of bounces makes 1
// everywhere.
TEST(LightLearning, KeepsTheFurnaceWhite) {
  std::string text = R"(LookAt 0 0 4  0.1 0.2 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 16 "integer yresolution" 16 "bool savefp16" false
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
)";
  text += rectangle(V3f(-1, -1, 0), V3f(2, 0, 0), V3f(0, 2, 0)) +
          rectangle(V3f(-1, -1, 0), V3f(2, 0, 0), V3f(0, 0, 1)) + rectangle(V3f(-1, 1, 0), V3f(2, 0, 0), V3f(0, 0, 1)) +
          rectangle(V3f(-1, -1, 0), V3f(0, 2, 0), V3f(0, 0, 1)) + rectangle(V3f(1, -1, 0), V3f(0, 2, 0), V3f(0, 0, 1));
  const Means on = render_paths(text, 1024, 12, 32, 200);
  EXPECT_NEAR(on.mean.mean(), 1, 0.004);  // five standard errors
  EXPECT_GT(test::z_test(on.mean, 1), 0.01) << on.mean.mean();
}

// One light with a place leaves nothing to choose: nothing is learned, and nothing changes.
TEST(LightLearning, LeavesSingleLampsAlone) {
  const build::BuiltScene built = test::build_text(camera + room(false) + lamp(V3f(-1, 0, 2.9f), 0.3f, 8));
  path::PathIntegrator::Settings s = test::bounces(2);
  const auto off = test::render_built(built, 2, s);
  s.learning_paths = 1024;
  const path::PathIntegrator on(*built.scene, s);
  EXPECT_FALSE(on.learned_lights());
  EXPECT_TRUE(test::same_bits(off.film, test::render_built(built, 2, on).film));
}

// Distribution ray tracing: purely diffuse points find the sky by shadow rays alone.
TEST(LightLearning, ServesDistributionRayTracing) {
  for (const auto& text : {window_room(), lamps_room()}) {
    const Means off = render_distribution(text, 0, 12), on = render_distribution(text, 512, 12);
    EXPECT_GT(test::z_test(on.mean, off.mean), test::sidak(0.01, 2)) << on.mean.mean() << " and " << off.mean.mean();
    EXPECT_LT(on.noise, off.noise);
  }
}

// Where nothing told points of grids to look for the sky, each that found it all the same was a fleck.
TEST(LightLearning, LeavesNoFlecksOnGrids) {
  const build::BuiltScene built =
      test::build_text(camera + std::string("LightSource \"infinite\" \"rgb L\" [ 2 2 2 ]\n") + room(true));
  build::IntegratorRequest request;
  request.type = "distribution";
  request.visible_points = distribution::VisiblePoints::grids;
  constexpr int seeds = 9;
  std::vector<test::RenderedText> made;
  for (int seed = 0; seed < seeds; ++seed)
    made.push_back(test::render_built(built, 16, *build::make_integrator(*built.scene, request, 16, uint64_t(seed))));
  const scene::Film& first = made[0].film;
  int flecks = 0;
  for (int y = 0; y < first.height(); ++y)
    for (int x = 0; x < first.width(); ++x) {
      float Y[seeds];
      for (int i = 0; i < seeds; ++i) Y[i] = std::min(made[size_t(i)].film.pixel(x, y).luminance(), 1.0f);
      std::sort(Y, Y + seeds);
      flecks += Y[seeds - 1] > 3 * Y[seeds / 2];
    }
  EXPECT_LE(flecks, first.width() * first.height() / 12);  // 3 of 10 before
}

}  // namespace
}  // namespace dapple
