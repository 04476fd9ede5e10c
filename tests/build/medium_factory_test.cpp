// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/medium_factory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "dapple/base/hash.h"
#include "dapple/build/scene_builder.h"
#include "dapple/image/texture_system.h"
#include "dapple/media/blackbody_table.h"
#include "dapple/media/exponential_medium.h"
#include "dapple/media/homogeneous_medium.h"
#include "tests/support/nvdb_writer.h"

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

/// A medium's file, gone after the test.
class Volume {
 public:
  explicit Volume(const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }
  ~Volume() { std::filesystem::remove(path); }
  const std::string path = testing::TempDir() + "medium_factory_" + std::to_string(getpid()) + ".nvdb";
};

test::NvdbWriter bar(const std::string& name, float value) {
  test::NvdbWriter w;
  w.name = name;
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z) w.set({x, y, z}, value);
  w.matrix = {0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5};
  return w;
}

// Twenty voxels half a unit apart, which the scene doubles: 19 units of density 2, and 1 where it falls to zero.
TEST_F(MediumFactory, NanovdbAndItsPlace) {
  for (const uint16_t codec : {0, 1, 2}) {
    const Volume file(test::nvdb_file({bar("density", 2)}, codec));
    const RGB d =
        depth(R"(Translate 0 0 4 Scale 2 2 2 MakeNamedMedium "m" "string type" "nanovdb" "string filename" ")" +
                  file.path + R"(" "rgb sigma_s" [ .1 .2 0 ] "rgb sigma_a" [ 0 0 .02 ] "float scale" .5)",
              Ray{.o = V3f(-1, 1.5f, 5.5f), .d = V3f(1, 0, 0)}, 50);
    EXPECT_NEAR(d.r, 0.05 * 2 * 19.5, 0.03);
    EXPECT_NEAR(d.g, 0.1 * 2 * 19.5, 0.08);
    EXPECT_NEAR(d.b, 0.01 * 2 * 19.5, 0.01);
    EXPECT_TRUE(diagnostics_.messages().empty()) << diagnostics_.messages().front();
  }
}

TEST_F(MediumFactory, NanovdbGlowsByItsTemperature) {
  const Volume file(test::nvdb_file({bar("density", 1), bar("temperature", 1500), bar("heat", 2)}));
  const auto glow = [&](const std::string& parameters) {
    const auto m =
        medium(R"(MakeNamedMedium "m" "string type" "nanovdb" "string filename" ")" + file.path + "\" " + parameters);
    double sum = 0;
    for (int i = 0; i < 4000; ++i)
      sum += double(m->sample({.o = V3f(-1, 0.7f, 0.7f), .d = V3f(1, 0, 0)}, infinity, RGB(1), hash(i)).emitted.r);
    EXPECT_EQ(m->emits(), sum > 0);
    return sum / 4000;
  };
  const double whole = glow("");
  EXPECT_GT(whole, 0);
  EXPECT_NEAR(glow("\"float Lescale\" 3") / whole, 3, 0.1);
  EXPECT_NEAR(glow("\"float LeScale\" 3") / whole, 3, 0.1);
  EXPECT_NEAR(
      glow(R"("string temperaturename" "heat" "float temperatureoffset" .5 "float temperaturescale" 1000)") / whole, 1,
      0.1);
  EXPECT_NEAR(
      glow(R"("string temperaturename" "heat" "float temperaturecutoff" .5 "float temperaturescale" 1000)") / whole, 1,
      0.1);
  EXPECT_EQ(glow("\"float temperaturescale\" .05"), 0);
  EXPECT_EQ(glow("\"float Lescale\" 0"), 0);
  EXPECT_TRUE(diagnostics_.messages().empty()) << diagnostics_.messages().front();
}

TEST_F(MediumFactory, NanovdbThatCannotBeReadIsAnErrorWithItsPlace) {
  const auto scene = [](const std::string& path, const std::string& more = "") {
    return R"(MakeNamedMedium "m" "string type" "nanovdb" "string filename" ")" + path + "\" " + more;
  };
  expect_error(R"(MakeNamedMedium "m" "string type" "nanovdb")", "filename");
  expect_error(scene("no-such-file.nvdb"), "cannot read");
  const std::string good = test::nvdb_file({bar("density", 2)});
  {
    const Volume file("not a volume, but as long as a header");
    expect_error(scene(file.path), "no NanoVDB file");
  }
  {
    const Volume file(good.substr(0, good.size() / 2));
    expect_error(scene(file.path), "bytes");
  }
  {
    const Volume file(good);
    expect_error(scene(file.path, "\"string gridname\" \"smoke\""), "no grid \"smoke\"; it has: density");
    expect_error(scene(file.path, "\"string temperaturename\" \"heat\""), "no grid \"heat\"");
    expect_error(scene(file.path, "\"float temperaturescale\" -1"), "negative");
    expect_error(scene(file.path, "\"rgb sigma_s\" [ 3e38 0 0 ]"), "overflows");
  }
}

TEST_F(MediumFactory, NanovdbSaysWhatItLeavesOut) {
  test::NvdbWriter w = bar("density", 2);
  w.set({3, 3, 3}, -1);
  const Volume file(test::nvdb_file({w}));
  medium(R"(MakeNamedMedium "m" "string type" "nanovdb" "string filename" ")" + file.path + "\"");
  ASSERT_EQ(diagnostics_.messages().size(), 1u);
  EXPECT_NE(diagnostics_.messages()[0].find("1 values of \"density\" are below zero"), std::string::npos);
  const Volume nothing(test::nvdb_file({test::NvdbWriter()}));
  const auto m = medium(R"(MakeNamedMedium "m" "string type" "nanovdb" "string filename" ")" + nothing.path + "\"");
  EXPECT_EQ(m->transmittance(along, infinity, 1), RGB(1));
  EXPECT_NE(diagnostics_.messages()[1].find("no active voxel"), std::string::npos);
}

// One value for the whole box: emission over absorption is that of a black body of (3 - 1) 1000 K.
TEST_F(MediumFactory, TemperatureOfAUniformGrid) {
  const auto m = medium(R"(MakeNamedMedium "m" "string type" "uniformgrid" "float density" [ 1 1 1 1 1 1 1 1 ]
"integer nx" 2 "integer ny" 2 "integer nz" 2 "float temperature" [ 3 3 3 3 3 3 3 3 ] "float temperatureoffset" 1
"float temperaturescale" 1000 "rgb sigma_s" [ 0 0 0 ] "rgb sigma_a" [ .2 .2 .2 ])");
  ASSERT_TRUE(m->emits());
  // Across the flat middle only.
  const Ray ray{.o = V3f(0.3f, 0.5f, 0.5f), .d = V3f(1, 0, 0)};
  double sum = 0;
  for (int i = 0; i < 100000; ++i) sum += double(m->sample(ray, 0.4f, RGB(1), hash(i)).emitted.luminance()) / 100000;
  const double expected = double(media::BlackbodyTable(2000)(2000).luminance()) * (1 - std::exp(-0.2 * 0.4));
  EXPECT_NEAR(sum / expected, 1, 0.02);
  expect_error(
      R"(MakeNamedMedium "m" "string type" "uniformgrid" "float density" [ 1 ] "float temperature" [ 3 ] "rgb Le" [ 1 1 1 ])",
      "exclude");
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
