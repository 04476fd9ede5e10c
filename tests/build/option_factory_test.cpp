// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/option_factory.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/build/scene_builder.h"
#include "dapple/numeric/spectrum.h"

namespace dapple::build {
namespace {

constexpr const char* camera = "Camera \"orthographic\"\n";

struct Read {
  BuiltScene built;
  std::vector<std::string> messages;

  /// A message at this line of the scene holds the text.
  bool names(int line, const std::string& text) const {
    return std::any_of(messages.begin(), messages.end(), [&](const std::string& m) {
      return m.find("test.pbrt:" + std::to_string(line) + ":") != std::string::npos &&
             m.find(text) != std::string::npos;
    });
  }
};

Read read(const std::string& head) {
  Diagnostics diagnostics;
  const auto description = scenefile::parse_pbrt(head + "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n",
                                                 "test.pbrt", ".", diagnostics);
  Read r{build_scene(description, {}, diagnostics), {}};
  r.messages = diagnostics.messages();
  return r;
}

void expect_error(const std::string& head, const std::string& text) {
  try {
    read(head);
    ADD_FAILURE() << "accepted: " << head;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
  }
}

TEST(Options, SeedsAreTheSamplersOrElseTheOptions) {
  EXPECT_FALSE(read(camera).built.request.seed);
  EXPECT_EQ(read(std::string("Option \"seed\" 7\n") + camera).built.request.seed, 7u);
  EXPECT_EQ(read(std::string("Option \"integer seed\" 7 Sampler \"halton\" \"integer seed\" 9\n") + camera)
                .built.request.seed,
            9u);
  expect_error(std::string("Option \"seed\" 7.5\n") + camera, "test.pbrt:1:");
}

TEST(Options, AreNamedOnceWhereTheyAreNotSupported) {
  const Read r = read(
      std::string(
          "Option \"disabletexturefiltering\" true\nOption \"forcediffuse\" true\nOption \"displacementedgescale\" 2\n"
          "Option \"msereferenceimage\" \"a.exr\"\nOption \"string nonsense\" \"x\"\nOption \"sed\" 5\n"
          "Option \"wavefront\" true\nOption \"rendercoordsys\" \"world\"\nOption \"float shadingrate\" 2\n") +
      camera);
  EXPECT_TRUE(r.names(1, "disabletexturefiltering"));
  EXPECT_TRUE(r.names(2, "forcediffuse"));
  EXPECT_TRUE(r.names(3, "displacementedgescale"));
  EXPECT_TRUE(r.names(4, "msereferenceimage"));
  EXPECT_TRUE(r.names(5, "\"nonsense\" of Option is not used"));
  EXPECT_TRUE(r.names(6, "\"sed\" of Option is not used; expected one of: origin, seed"));
  EXPECT_EQ(r.messages.size(), 6u);
  EXPECT_TRUE(read(std::string("Option \"forcediffuse\" false\n") + camera).messages.empty());
}

TEST(Options, ShadingRateIsAboveZero) {
  expect_error(std::string("Option \"float shadingrate\" 0\n") + camera, "test.pbrt:1:");
  expect_error(std::string("Option \"float shadingrate\" -1\n") + camera, "\"shadingrate\" is -1");
}

// A gaussian of a radius that its bins step over is nothing but zeros.
TEST(PixelFilters, CountSomething) {
  const auto filter = [](const std::string& type, const char* radius) {
    return "PixelFilter \"" + type + "\" \"float xradius\" " + radius + " \"float yradius\" " + radius + "\n" + camera;
  };
  for (const char* radius : {"3000", "10000", "60000"})
    expect_error(filter("gaussian", radius), "test.pbrt:1:1: the pixel filter");
  for (const char* type : {"box", "triangle", "mitchell", "sinc"})
    EXPECT_TRUE(read(filter(type, "10000")).messages.empty()) << type;
}

TEST(Options, WithoutJitterSamplesAreInTheMiddle) {
  const BuiltScene b =
      read("Option \"disablepixeljitter\" true\nCamera \"perspective\" \"float lensradius\" .1\n").built;
  const auto at = b.scene->filter.sample({0.9f, 0.2f});
  EXPECT_EQ(at.offset, V2f(0, 0));
  EXPECT_EQ(at.weight, 1);
  EXPECT_FALSE(b.scene->camera.has_lens());
  EXPECT_EQ(b.scene->camera.generate({1, 1}, {0, 0}, 0.9f).ray.time, 0.5f);
}

// Light of the colour that the film is balanced for comes out white, of the same luminance.
TEST(FilmOptions, WhiteBalance) {
  const auto balance = [](const std::string& value) {
    return read(camera + ("Film \"rgb\" \"float whitebalance\" " + value + "\n")).built.scene->film.white_balance;
  };
  EXPECT_FALSE(balance("0"));
  for (const double kelvin : {3000.0, 4500.0, 9000.0}) {
    const RGB light = xyz_to_rgb(integrate_xyz(kelvin < 4000 ? blackbody(kelvin) : daylight(kelvin)));
    const RGB seen = (*balance(std::to_string(kelvin)))(light * (1 / light.luminance()));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen[c], 1, 2e-3) << kelvin;
  }
  const RGB grey = (*balance("9000"))(RGB(1));  // bluish light is taken for white: white turns yellow
  EXPECT_GT(grey.r, grey.g);
  EXPECT_GT(grey.g, grey.b);
  EXPECT_THROW(balance("-1"), InputError);
}

// pbrt-v4: (shutterclose - shutteropen) iso / 100.
TEST(Exposure, IsTheTimeThatTheShutterIsOpen) {
  EXPECT_FLOAT_EQ(read(camera).built.scene->film.scale, 1);
  EXPECT_FLOAT_EQ(read("Camera \"orthographic\" \"float shutterclose\" .5\n").built.scene->film.scale, 0.5f);
  EXPECT_FLOAT_EQ(read("Film \"rgb\" \"float iso\" 200\nCamera \"orthographic\" \"float shutteropen\" 1 \"float "
                       "shutterclose\" 1.25\n")
                      .built.scene->film.scale,
                  0.5f);
  EXPECT_FLOAT_EQ(read("Film \"rgb\" \"float exposuretime\" 3\nCamera \"orthographic\" \"float shutterclose\" .5\n")
                      .built.scene->film.scale,
                  3);
  expect_error("Camera \"orthographic\" \"float shutteropen\" 1\n", "the shutter does not open");
  expect_error("Camera \"orthographic\" \"float shutteropen\" 2\n", "the shutter does not open");
}

}  // namespace
}  // namespace dapple::build
