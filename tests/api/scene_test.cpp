// SPDX-License-Identifier: Apache-2.0
// The library as programs outside use it: what is made in code, read and changed renders as the scene language says.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "tests/api/support.h"

namespace dapple {
namespace {

constexpr double pi = 3.14159265358979;

using test::error_of;
using test::expect_same;
using test::mean;
using test::room;
using test::written;

// The program of README.md, whose light has a closed form: a floor of albedo .5 under a lamp in the zenith, of
// intensity I at distance h, sends .5 / pi * I / h^2 straight up.
TEST(Library, TwentyLines) {
  Scene scene;
  scene.camera("orthographic", {{"float screenwindow", {-.01, .01, -.01, .01}}},
               Placement::look_at({0, 0, 3}, {0, 0, 0}, {0, 1, 0}));
  scene.film("rgb", {{"integer xresolution", 8}, {"integer yresolution", 8}});
  scene.material("grey", "diffuse", {{"rgb reflectance", {.5, .5, .5}}});
  const float P[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  const int32_t indices[] = {0, 1, 2, 0, 2, 3};
  scene.shape({"trianglemesh", {{"point3 P", P}, {"integer indices", indices}}, "floor", "grey"});
  scene.light("lamp", "point", {{"rgb I", {4, 4, 4}}, {"float scale", 1}}, Placement::translate(0, 0, 2));
  RenderOptions options;
  options.integrator = "path";
  options.pixel_samples = 4;
  options.denoise = false;
  const Picture picture = scene.render(options);
  // "scale" multiplies; pbrt's point light of I = rgb is that intensity.
  EXPECT_NEAR(picture.picture().pixel(4, 4)[1], .5 / pi * 4 / 4, 2e-3);
  EXPECT_EQ(picture.statistics.pixel_samples, 4u);
  EXPECT_TRUE(picture.statistics.finished);
  EXPECT_GT(picture.statistics.rays, 64u * 4);
  scene.edit("light", "lamp", {{"float scale", 2}});
  EXPECT_NEAR(scene.render(options).picture().pixel(4, 4)[1], 2 * .5 / pi, 4e-3);
}

TEST(Library, LayersAndCrops) {
  Scene scene = Scene::parse(room);
  RenderOptions o;
  o.aovs = {"albedo", "normal", "depth"};
  o.light_groups = true;
  const Picture whole = scene.render(o);
  ASSERT_NE(whole.layer("depth"), nullptr);
  EXPECT_EQ(whole.layer("depth")->channels.size(), 1u);
  EXPECT_EQ(whole.layer("albedo")->pixels.size(), 32u * 24 * 3);
  EXPECT_EQ(whole.layer("none"), nullptr);
  o = {};
  const Picture plain = scene.render(o);
  o.crop = {{8, 4, 20, 16}};
  const Picture crop = scene.render(o);
  ASSERT_EQ(crop.picture().width, 12);
  EXPECT_EQ(crop.origin_x, 8);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 12; ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(crop.picture().pixel(x, y)[c], plain.picture().pixel(x + 8, y + 4)[c]) << x << ' ' << y;
}

// Large arrays do not go through text, and become text when the scene is written.
TEST(Library, LargeMeshes) {
  constexpr int n = 40;
  std::vector<float> P;
  std::vector<int32_t> indices;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      P.insert(P.end(), {float(i) / n * 4 - 2, .2f * std::sin(float(i * j)), float(j) / n * 4 - 2});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int32_t a = j * (n + 1) + i;
      indices.insert(indices.end(), {a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2});
    }
  for (const float shift : {0.0f, 30000.0f}) {  // far points are kept less a base
    std::vector<float> far = P;
    for (size_t i = 0; i < far.size(); i += 3) far[i] += shift;
    Scene scene = Scene::parse(room);
    scene.edit("camera", "", {{"float move", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, shift, 0, 0, 1}}});
    scene.object(
        "hills",
        {{"trianglemesh",
          {{"point3 P", std::span<const float>(far)}, {"integer indices", std::span<const int32_t>(indices)}}}});
    scene.instance("hills", "", Placement::translate(0, .5, 0));
    scene.shape({"trianglemesh",
                 {{"point3 P", std::span<const float>(far)}, {"integer indices", std::span<const int32_t>(indices)}},
                 "waves",
                 "gloss"});
    Scene read = Scene::load(written(scene));
    expect_same(scene.render(), read.render());
  }
  std::vector<float> odd(99, std::numeric_limits<float>::quiet_NaN());
  Scene scene = Scene::parse(room);
  EXPECT_NE(std::string(error_of([&] {
                          scene.shape({"trianglemesh", {{"point3 P", std::span<const float>(odd)}}});
                        }).what())
                .find("not finite"),
            std::string::npos);
  EXPECT_NE(std::string(error_of([&] {
                          scene.shape({"trianglemesh", {{"integer indices", std::span<const float>(P)}}});
                        }).what())
                .find("floats"),
            std::string::npos);
  EXPECT_EQ(scene.names("shape"), Scene::parse(room).names("shape"));
}

TEST(Library, ErrorsHavePlaces) {
  const SceneError in_text = error_of([] { Scene::parse("WorldBegin\nShape 3\n"); });
  EXPECT_EQ(in_text.kind(), SceneError::Kind::input);
  EXPECT_EQ(in_text.line(), 2);
  EXPECT_EQ(in_text.column(), 7);
  const SceneError missing = error_of([] { Scene::load("/nowhere/at/all.pbrt"); });
  EXPECT_EQ(missing.file(), "/nowhere/at/all.pbrt");
  EXPECT_EQ(error_of([] { Scene::load(""); }).kind(), SceneError::Kind::usage);
  Scene scene = Scene::parse(room);
  RenderOptions o;
  o.integrator = "magic";
  EXPECT_EQ(error_of([&] { scene.render(o); }).kind(), SceneError::Kind::usage);
  o = {};
  o.pixel_samples = 0;
  EXPECT_EQ(error_of([&] { scene.render(o); }).kind(), SceneError::Kind::usage);
  o = {};
  o.aovs = {"beauty"};
  EXPECT_EQ(error_of([&] { scene.render(o); }).kind(), SceneError::Kind::usage);
  EXPECT_EQ(error_of([&] { scene.render().write("/nowhere/a.exr"); }).kind(), SceneError::Kind::io);
  Scene empty;
  EXPECT_NE(std::string(error_of([&] { empty.render(); }).what()).find("no Camera"), std::string::npos);
}

TEST(Library, ProgressStopsARendering) {
  Scene scene = Scene::parse(room);
  RenderOptions o;
  o.pixel_samples = 100000;
  int calls = 0;
  o.progress = [&](const Progress&) { return ++calls < 3; };
  const Picture picture = scene.render(o);
  EXPECT_FALSE(picture.statistics.finished);
  EXPECT_EQ(calls, 3);
  o.progress = [](const Progress&) -> bool { throw std::runtime_error("mine"); };
  EXPECT_THROW(scene.render(o), std::runtime_error);
}

TEST(Library, PicturesInFiles) {
  Scene scene = Scene::parse(room);
  RenderOptions o;
  o.aovs = {"albedo", "normal"};
  const Picture picture = scene.render(o);
  const std::string path = testing::TempDir() + "/api-" + std::to_string(::getpid()) + ".exr";
  picture.write(path);
  const Picture back = read(path);
  EXPECT_EQ(back.picture().pixels, picture.picture().pixels);
  ASSERT_NE(back.layer("normal"), nullptr);
  EXPECT_EQ(back.layer("normal")->pixels, picture.layer("normal")->pixels);
  const Layer clean = denoised(picture.picture(), picture.layer("albedo"), picture.layer("normal"));
  EXPECT_NEAR(mean(clean), mean(picture.picture()), .1 * mean(picture.picture()));
  EXPECT_NE(clean.pixels, picture.picture().pixels);
  std::filesystem::remove(path);
  EXPECT_THROW(read(path), SceneError);
}

// Two scenes in one process know nothing of each other.
TEST(Library, TwoScenes) {
  Scene a = Scene::parse(room), b = Scene::parse(room);
  const Picture alone = a.render();
  b.edit("light", "key", {{"float scale", 3}});
  const Picture other = b.render();
  expect_same(a.render(), alone);
  EXPECT_GT(mean(other.picture()), 1.2 * mean(alone.picture()));
  expect_same(b.render(), other);
}

TEST(Library, ParametersAreRead) {
  Scene scene = Scene::parse(room);
  const auto I = scene.parameter("light", "key", "I");
  ASSERT_TRUE(I);
  EXPECT_EQ(I->declaration, "rgb I");
  EXPECT_EQ(std::get<std::vector<double>>(I->value), (std::vector<double>{20, 20, 20}));
  EXPECT_FALSE(scene.parameter("light", "key", "scale"));
  EXPECT_FALSE(std::get<bool>(scene.parameter("integrator", "", "denoise")->value));
  EXPECT_EQ(std::get<std::vector<std::string>>(scene.parameter("material", "floor", "reflectance")->value)[0],
            "checks");
}

}  // namespace
}  // namespace dapple
