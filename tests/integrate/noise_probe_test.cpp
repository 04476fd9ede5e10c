// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/noise_probe.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dapple/base/hash.h"
#include "dapple/build/integrator_factory.h"
#include "dapple/path/path_integrator.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple::integrate {
namespace {

// Samples of 1 with noise of this standard deviation, times `right` in the right half of the film.
class Grain final : public Integrator {
 public:
  explicit Grain(float deviation, float right = 1) : deviation_(deviation), right_(right) {}
  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<Workspace>(); }
  void render(const TileWork& work, Workspace&, scene::Film& film) const override {
    for (int y = work.pixels.min.y; y < work.pixels.max.y; ++y)
      for (int x = work.pixels.min.x; x < work.pixels.max.x; ++x)
        for (uint32_t s = work.first_sample; s < work.first_sample + work.sample_count; ++s) {
          const float random = 2 * to_unit_float(hash(x, y, s)) - 1;
          film.add(x, y, 1,
                   RGB(1 + std::sqrt(3.0f) * random * deviation_ * (2 * x < film.settings().resolution.x ? 1 : right_)),
                   {});
        }
  }

 private:
  float deviation_, right_;
};

scene::Film::Settings film_of(int width, int height) {
  scene::Film::Settings film;
  film.resolution = {width, height};
  return film;
}

TEST(NoiseProbe, ComparesVariances) {
  const NoiseProbe probe(film_of(240, 135), 16);
  ASSERT_FALSE(probe.has_too_few_boxes());
  const auto ratio = [&](const Grain& a, const Grain& b) { return probe.variance_ratio(a, b, {}).value; };
  EXPECT_NEAR(ratio(Grain(.1f), Grain(.2f)), .25, .25 * .02);
  EXPECT_NEAR(ratio(Grain(.2f), Grain(.2f)), 1, 1e-6);
  EXPECT_LT(probe.variance_ratio(Grain(.1f), Grain(.2f), {}).error, .01);
  EXPECT_EQ(ratio(Grain(0), Grain(0)), 1) << "no noise";
  // Of .05 and .2, in the halves of the film, and .05 and .4: the more noise there is the more it counts.
  EXPECT_NEAR(ratio(Grain(.05f, 4), Grain(.1f, 4)), .25, .25 * .03);
  EXPECT_NEAR(ratio(Grain(.05f, 4), Grain(.05f, 8)), .0425 / .1625, .03);
  // Half of the boxes are no better: the ratio of few is not known well.
  const NoiseProbe::Ratio uneven = probe.variance_ratio(Grain(.1f, .5f), Grain(.1f), {});
  EXPECT_NEAR(uneven.value, .625, .08);
  EXPECT_NEAR(uneven.error, .375 / std::sqrt(31), .02);
}

// Weights of a filter with negative lobes are no noise: where samples are all alike there is none to compare.
TEST(NoiseProbe, TakesTheFilmAsItIs) {
  scene::Film::Settings film = film_of(240, 135);
  film.max_component = .5f;  // which all samples are scaled down to
  EXPECT_EQ(NoiseProbe(film, 16).variance_ratio(Grain(.1f), Grain(.2f), {}).value, 1);
}

TEST(NoiseProbe, LeavesSmallImagesAlone) {
  EXPECT_TRUE(NoiseProbe(film_of(64, 64), 16).has_too_few_boxes());
  EXPECT_TRUE(NoiseProbe(film_of(4, 100000), 16).has_too_few_boxes());
  EXPECT_FALSE(NoiseProbe(film_of(64, 64), 64).has_too_few_boxes());
}

std::string sphere_in(const std::string& surroundings) {
  return R"(Film "rgb" "integer xresolution" 128 "integer yresolution" 128
LookAt 0 -3 1  0 0 .5  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
AttributeBegin
Translate 0 0 .5
Shape "sphere" "float radius" .5
AttributeEnd
)" + surroundings;
}

bool default_reads_cache(const std::string& text) {
  const auto built = test::build_text(text);
  build::IntegratorRequest request;
  request.type = "distribution";
  const auto made = build::make_integrator(*built.scene, request, 16, 0);
  const auto* paths = dynamic_cast<const path::PathIntegrator*>(made.get());
  EXPECT_NE(paths, nullptr);
  return paths && paths->ends_in_cache();
}

// Under an open sky most noise is that of the sky itself, which no cache takes away; in a closed room with a lamp
// behind a shade it is that of light that walls send on. By a filter whose weights differ, too.
TEST(NoiseProbe, KeepsTheCacheWhereItTakesNoiseAway) {
  const std::string floor = test::wall({-9, -9, 0}, {9, -9, 0}, {-9, 9, 0}, {9, 9, 0});
  EXPECT_FALSE(default_reads_cache(sphere_in("LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n" + floor)));
  std::string room = "LightSource \"spot\" \"point3 from\" [ 0 0 1.6 ] \"point3 to\" [ 0 0 9 ] \"rgb I\" [ 9 9 9 ]\n";
  for (const std::string& side : {test::wall({-4, -4, 0}, {4, -4, 0}, {-4, 4, 0}, {4, 4, 0}),
                                  test::wall({-4, 4, 3}, {4, 4, 3}, {-4, -4, 3}, {4, -4, 3}),
                                  test::wall({-4, -4, 0}, {-4, 4, 0}, {-4, -4, 3}, {-4, 4, 3}),
                                  test::wall({4, 4, 0}, {4, -4, 0}, {4, 4, 3}, {4, -4, 3}),
                                  test::wall({-4, 4, 0}, {4, 4, 0}, {-4, 4, 3}, {4, 4, 3}),
                                  test::wall({4, -4, 0}, {-4, -4, 0}, {4, -4, 3}, {-4, -4, 3})})
    room += side;
  EXPECT_TRUE(default_reads_cache(sphere_in(room)));
  EXPECT_TRUE(default_reads_cache("PixelFilter \"mitchell\"\n" + sphere_in(room)));
}

}  // namespace
}  // namespace dapple::integrate
