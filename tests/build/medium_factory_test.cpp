// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/medium_factory.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/build/scene_builder.h"
#include "dapple/image/texture_system.h"
#include "dapple/media/exponential_medium.h"
#include "dapple/media/homogeneous_medium.h"

namespace dapple::build {
namespace {

class MediumFactory : public testing::Test {
 protected:
  std::shared_ptr<const media::Medium> medium(const std::string& directives) {
    description_ = scenefile::parse_pbrt("WorldBegin\n" + directives + "\n", "media.pbrt", "", diagnostics_);
    const BuildContext context{description_, diagnostics_, textures_};
    return make_media(context, TextureLibrary(context)).at(0);
  }
  RGB depth(const std::string& directives, const Ray& ray, float t_max) {
    RGB mean;
    const auto m = medium(directives);
    for (int i = 0; i < 20000; ++i) mean += m->transmittance(ray, t_max, hash(i)) * (1 / 20000.0f);
    return {-std::log(mean.r), -std::log(mean.g), -std::log(mean.b)};
  }
  void expect_error(const std::string& directives, const std::string& text) {
    try {
      medium(directives);
      ADD_FAILURE() << "accepted: " << directives;
    } catch (const InputError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.rfind("media.pbrt:2:", 0), 0u) << what;
      EXPECT_NE(what.find(text), std::string::npos) << what;
    }
  }

  Diagnostics diagnostics_;
  image::TextureSystem textures_{uint64_t{1} << 20};
  scenefile::SceneDescription description_;
};

const Ray along{.o = V3f(-1, 0.5f, 0.5f), .d = V3f(1, 0, 0)};

TEST_F(MediumFactory, Homogeneous) {
  const auto m = medium(
      R"(MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ 1 0 0 ] "rgb sigma_s" [ 1 2 3 ] "float scale" .5 "float g" .3)");
  const auto& h = dynamic_cast<const media::HomogeneousMedium&>(*m);
  EXPECT_EQ(h.sigma_t(), RGB(1, 1, 1.5f));
  EXPECT_EQ(h.sigma_s(), RGB(0.5f, 1, 1.5f));
  EXPECT_FLOAT_EQ(m->phase().g, 0.3f);
  const auto plain = medium(R"(MakeNamedMedium "fog" "string type" "homogeneous")");  // coefficients default to 1
  EXPECT_EQ(dynamic_cast<const media::HomogeneousMedium&>(*plain).sigma_t(), RGB(2));
  const auto skin =
      medium(R"(MakeNamedMedium "fog" "string type" "homogeneous" "string preset" "Skin1" "float scale" 10)");
  EXPECT_NEAR(dynamic_cast<const media::HomogeneousMedium&>(*skin).sigma_s().g, 8.8f, 1e-5f);
  EXPECT_EQ(diagnostics_.count(), 0u);
}

TEST_F(MediumFactory, Exponential) {
  const auto m = medium(
      R"(Translate 0 0 5 MakeNamedMedium "haze" "string type" "exponential" "rgb sigma_a" [ 0 0 0 ] "rgb sigma_s" [ 1 2 3 ] "float scaleheight" 4 "vector3 up" [ 0 0 2 ])");
  const auto& h = dynamic_cast<const media::ExponentialMedium&>(*m);
  EXPECT_EQ(h.sigma_t(), RGB(1, 2, 3));
  EXPECT_NEAR(h.density().at(V3f(7, -3, 5)), 1, 1e-6f);  // height 0 is the origin of its own space
  EXPECT_NEAR(h.density().at(V3f(0, 0, 9)), std::exp(-1.0f), 1e-6f);
  EXPECT_NEAR(h.density().at(V3f(0, 0, 1)), std::exp(1.0f), 1e-5f);
  // Heights are those of its space: scaled twice, it thins out over twice as much.
  const auto scaled = medium(R"(Scale 2 2 2 MakeNamedMedium "haze" "string type" "exponential" "float scaleheight" 4)");
  EXPECT_NEAR(dynamic_cast<const media::ExponentialMedium&>(*scaled).density().at(V3f(0, 0, 8)), std::exp(-1.0f),
              1e-6f);
  EXPECT_EQ(diagnostics_.count(), 0u);
  expect_error(R"(MakeNamedMedium "m" "string type" "exponential" "float scaleheight" 0)", "scaleheight");
  expect_error(R"(MakeNamedMedium "m" "string type" "exponential" "float scaleheight" -2)", "scaleheight");
  expect_error(R"(MakeNamedMedium "m" "string type" "exponential" "vector3 up" [ 0 0 0 ])", "up");
}

TEST_F(MediumFactory, UniformGrid) {
  // Optical depth through cells 1, 3 of width 1/2: flat middle half of mean 2, and the outer quarters fall to zero from
  // 1 and 3.
  const RGB d = depth(
      R"(MakeNamedMedium "g" "string type" "uniformgrid" "integer nx" 2 "float density" [ 1 3 ] "rgb sigma_a" [ .1 .2 .3 ] "rgb sigma_s" [ 0 0 .1 ] "float scale" 2)",
      along, 10);
  const double inner =
      0.25 * 0.75 * 4 + 0.5 * 2;  // two quarters of mean (1 / 2 + 1) / 2 and (3 / 2 + 3) / 2, and the middle
  EXPECT_NEAR(d.r, 0.2 * inner, 0.01);
  EXPECT_NEAR(d.g, 0.4 * inner, 0.02);
  EXPECT_NEAR(d.b, 0.8 * inner, 0.03);
}

TEST_F(MediumFactory, RgbGridAndItsPlace) {
  const RGB d = depth(
      R"(Translate 0 0 4 Scale 2 2 2 MakeNamedMedium "g" "string type" "rgbgrid" "integer nx" 1 "rgb sigma_s" [ 1 2 0 ] "rgb sigma_a" [ 0 0 0 ] "point3 p0" [ 0 0 0 ] "point3 p1" [ 1 1 1 ])",
      Ray{.o = V3f(-1, 1, 5), .d = V3f(1, 0, 0)}, 10);
  EXPECT_NEAR(d.r, 2 * 0.75, 0.04);  // one value, falling to half at the faces; the box is 2 wide in the world
  EXPECT_NEAR(d.g, 2 * 1.5, 0.06);
  EXPECT_NEAR(d.b, 0, 1e-3);
}

// Density x of the world over a box from 0 to 2: optical depths 2 sigma_t.
TEST_F(MediumFactory, Pattern) {
  const std::string ramp = R"(Texture "x" "float" "coordinate" "string which" "x" "string space" "world" )";
  const RGB d =
      depth(ramp + R"(Scale 2 1 1 MakeNamedMedium "p" "string type" "pattern" "texture density" "x" "float maxdensity" 2
  "rgb sigma_a" [ .1 .2 .3 ] "rgb sigma_s" [ 0 0 .1 ])",
            along, 10);
  EXPECT_NEAR(d.r, 0.2, 0.01);
  EXPECT_NEAR(d.g, 0.4, 0.01);
  EXPECT_NEAR(d.b, 0.8, 0.02);
  EXPECT_EQ(diagnostics_.count(), 0u);
  expect_error(ramp + R"(MakeNamedMedium "p" "string type" "pattern" "texture density" "x")",
               "expected \"float maxdensity\"");
  expect_error(ramp + R"(MakeNamedMedium "p" "string type" "pattern" "texture density" "x" "float maxdensity" -1)",
               "negative");
  expect_error(R"(MakeNamedMedium "p" "string type" "pattern" "float density" -1)", "negative");
  expect_error(R"(MakeNamedMedium "p" "string type" "pattern" "texture density" "y" "float maxdensity" 1)", "\"y\"");
  expect_error(R"(MakeNamedMedium "p" "string type" "pattern" "point3 p1" [ 1 0 1 ])", "no volume");
}

TEST_F(MediumFactory, BadInputIsAnErrorWithItsPlace) {
  expect_error(R"(MakeNamedMedium "m" "string type" "soup")",
               "expected one of: homogeneous, uniformgrid, rgbgrid, pattern, exponential, cloud, nanovdb");
  expect_error(R"(MakeNamedMedium "m" "string type" "homogeneous" "float g" 1)", "\"g\"");
  expect_error(R"(MakeNamedMedium "m" "string type" "homogeneous" "float scale" -1)", "negative");
  expect_error(R"(MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_s" [ -1 0 0 ])", "");
  expect_error(R"(MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_s" [ 1e38 0 0 ] "float scale" 1e9)",
               "overflows");
  expect_error(R"(MakeNamedMedium "m" "string type" "homogeneous" "string preset" "Gravel")", "Wholemilk");
  expect_error(R"(MakeNamedMedium "m" "string type" "uniformgrid")", "density");
  expect_error(R"(MakeNamedMedium "m" "string type" "uniformgrid" "integer nx" 3 "float density" [ 1 2 ])",
               "expected nx * ny * nz = 3");
  expect_error(
      R"(MakeNamedMedium "m" "string type" "uniformgrid" "integer nx" 2000000000 "integer ny" 2000000000 "float density" [ 1 2 ])",
      "expected nx");
  expect_error(R"(MakeNamedMedium "m" "string type" "uniformgrid" "integer nx" -1 "float density" [ 1 ])",
               "at least 1");
  expect_error(R"(MakeNamedMedium "m" "string type" "uniformgrid" "float density" [ -1 ])", "negative");
  expect_error(R"(MakeNamedMedium "m" "string type" "uniformgrid" "float density" [ 1 ] "point3 p1" [ 1 0 1 ])",
               "no volume");
  expect_error(R"(MakeNamedMedium "m" "string type" "rgbgrid")", "sigma_a");
  expect_error(R"(MakeNamedMedium "m" "string type" "rgbgrid" "rgb sigma_s" [ 1 1 1 ] "rgb Le" [ 1 1 1 ])", "sigma_a");
}

TEST_F(MediumFactory, StandInsAreNamedAndTransparent) {
  const auto m = medium(R"(MakeNamedMedium "m" "string type" "nanovdb" "string filename" "a.nvdb")");
  EXPECT_EQ(m->transmittance(along, infinity, 1), RGB(1));
  EXPECT_EQ(diagnostics_.unsupported_features().size(), 1u);
}

// It is full at its bottom, all but .01 at y = .02 of 4: a ray along x passes 4 there.
TEST_F(MediumFactory, CloudsAreDenseBelow) {
  const auto m =
      medium(R"(Scale 4 4 4 MakeNamedMedium "m" "string type" "cloud" "float wispiness" 2 "rgb sigma_a" [ .1 .1 .1 ]
"rgb sigma_s" [ 0 0 0 ])");
  EXPECT_TRUE(diagnostics_.unsupported_features().empty());
  const Ray ray{.o = V3f(-1, 0.02f, 2), .d = V3f(1, 0, 0)};
  double sum = 0;
  for (uint64_t i = 0; i < 40000; ++i) sum += double(m->transmittance(ray, infinity, i).g);
  EXPECT_NEAR(sum / 40000, std::exp(-0.4), 0.01);
  expect_error(R"(MakeNamedMedium "m" "string type" "cloud" "float density" -1)", "negative");
}

// Rationale: what glows is a light, and a scene that has none is named by its file.
TEST(SceneBuilder, SaysThatThereIsNoLightWhereNothingGlows) {
  const auto messages = [](const std::string& emission) {
    Diagnostics diagnostics;
    const auto description = scenefile::parse_pbrt(
        "Camera \"perspective\" WorldBegin MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb Le\" " +
            emission + " MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\"\n",
        "glow.pbrt", "", diagnostics);
    build_scene(description, {}, diagnostics);
    return diagnostics.messages();
  };
  EXPECT_TRUE(messages("[ 1 1 1 ]").empty()) << messages("[ 1 1 1 ]").front();
  const auto dark = messages("[ 0 0 0 ]");
  ASSERT_EQ(dark.size(), 1u);
  EXPECT_EQ(dark[0].rfind("glow.pbrt: the scene has no light", 0), 0u) << dark[0];
}

}  // namespace
}  // namespace dapple::build
