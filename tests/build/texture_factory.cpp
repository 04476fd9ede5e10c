// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_factory.h"

#include <gtest/gtest.h>

#include "dapple/image/image_writer.h"
#include "dapple/image/texture_system.h"
#include "tests/image/temporary_folder.h"
#include "tests/shading/texture_points.h"

namespace dapple::build {
namespace {

using shading::test::value_at;

/// A scene with some textures, and a material whose parameters look them up.
struct TestScene {
  explicit TestScene(const std::string& textures, const std::string& parameters = "", bool keep_going = false,
                     const std::string& folder = ".")
      : description(scenefile::parse_pbrt("WorldBegin\n" + textures + "\nMaterial \"diffuse\" " + parameters + "\n",
                                          "test.pbrt", folder, diagnostics)),
        context{description, diagnostics, system, keep_going},
        library(context) {}
  const scenefile::ParamSet& params() const { return description.materials.back().params; }

  Diagnostics diagnostics;
  image::TextureSystem system;
  scenefile::SceneDescription description;
  BuildContext context;
  TextureLibrary library;
};

std::string error_of(const std::string& textures, const std::string& parameters = "") {
  try {
    const TestScene scene(textures, parameters);
    scene.library.float_texture(scene.params(), "f", 0);
    scene.library.reflectance_texture(scene.params(), "c", RGB(0));
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

bool mentions(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& w : words)
    if (text.find(w) == std::string::npos) return false;
  return true;
}

TEST(TextureLibrary, NumbersAndFallbacks) {
  const TestScene scene("", R"("float a" 3  "rgb b" [.1 .2 .3])");
  EXPECT_EQ(scene.library.float_texture(scene.params(), "a", 7)->constant(), 3);
  EXPECT_EQ(scene.library.float_texture(scene.params(), "none", 7)->constant(), 7);
  EXPECT_EQ(scene.library.optional_float_texture(scene.params(), "none"), nullptr);
  EXPECT_EQ(scene.library.reflectance_texture(scene.params(), "b", RGB(0))->constant(), RGB(.1f, .2f, .3f));
  EXPECT_EQ(scene.library.unbounded_texture(scene.params(), "none", RGB(5))->constant(), RGB(5));
  EXPECT_EQ(scene.library.optional_reflectance_texture(scene.params(), "none"), nullptr);
  EXPECT_EQ(scene.library.optional_unbounded_texture(scene.params(), "none"), nullptr);
}

TEST(TextureLibrary, ConstantsFold) {
  const TestScene scene(R"(
    Texture "two" "float" "constant" "float value" 2
    Texture "six" "float" "scale" "texture tex" "two" "float scale" 3
    Texture "mean" "float" "mix" "texture tex1" "two" "texture tex2" "six" "float amount" .25
    Texture "red" "spectrum" "constant" "rgb value" [.8 0 0]
    Texture "dark" "spectrum" "scale" "texture tex" "red" "float scale" .5)",
                        R"("texture f" "mean" "texture c" "dark")");
  EXPECT_EQ(scene.library.float_texture(scene.params(), "f", 0)->constant(), 3);
  EXPECT_EQ(scene.library.reflectance_texture(scene.params(), "c", RGB(0))->constant(), RGB(.4f, 0, 0));
  EXPECT_EQ(scene.diagnostics.count(), 0u);
}

TEST(TextureLibrary, AReflectanceIsClampedOnlyWhereItIsOne) {
  const TestScene scene(R"(Texture "bright" "spectrum" "constant" "rgb value" [3 2 1])", R"("texture c" "bright")");
  EXPECT_EQ(scene.library.unbounded_texture(scene.params(), "c", RGB(0))->constant(), RGB(3, 2, 1));
  EXPECT_EQ(scene.diagnostics.count(), 0u);
  EXPECT_EQ(scene.library.reflectance_texture(scene.params(), "c", RGB(0))->constant(), RGB(1));
  EXPECT_EQ(scene.diagnostics.count(), 1u);
}

TEST(TextureLibrary, EveryTypeIsMade) {
  for (const char* type : {"constant", "scale", "mix", "directionmix", "bilerp", "checkerboard", "dots", "fbm",
                           "wrinkled", "windy", "ptex"}) {
    const TestScene scene("Texture \"t\" \"float\" \"" + std::string(type) + "\"", R"("texture f" "t")");
    EXPECT_TRUE(std::isfinite(value_at(*scene.library.float_texture(scene.params(), "f", 0), 0.3f, 0.4f))) << type;
  }
  for (const char* type :
       {"constant", "scale", "mix", "directionmix", "bilerp", "checkerboard", "dots", "marble", "ptex"}) {
    const TestScene scene("Texture \"t\" \"spectrum\" \"" + std::string(type) + "\"", R"("texture c" "t")");
    EXPECT_TRUE(value_at(*scene.library.reflectance_texture(scene.params(), "c", RGB(0)), 0.3f, 0.4f).is_finite())
        << type;
  }
}

TEST(TextureLibrary, ParametersReachTheTexture) {
  const TestScene scene(R"(
    Texture "t" "float" "checkerboard" "float tex1" 4 "float tex2" 9 "float uscale" 2 "float vscale" 2 "float udelta" 1
    Translate 0 0 10
    Texture "p" "float" "bilerp" "string mapping" "planar" "vector3 v1" [0 0 1] "float v00" 0 "float v01" 0 "float v10" 1 "float v11" 1)",
                        R"("texture f" "t" "texture g" "p")");
  const auto t = scene.library.float_texture(scene.params(), "f", 0);
  EXPECT_EQ(value_at(*t, 0.2f, 0.2f), 9);
  EXPECT_EQ(value_at(*t, 0.2f, 0.7f), 4);
  const auto p = scene.library.float_texture(scene.params(), "g", 0);
  EXPECT_FLOAT_EQ(value_at(*p, V3f(1, 2, 10.25f)), 0.25f);
  EXPECT_EQ(scene.diagnostics.count(), 0u);
}

TEST(TextureLibrary, ErrorsNameWhatIsLegal) {
  EXPECT_TRUE(
      mentions(error_of(R"(Texture "t" "float" "marmble")"), {"test.pbrt:2", "marmble", "wrinkled", "checkerboard"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "marble")"), {"float texture", "fbm"}));
  EXPECT_TRUE(mentions(error_of("", R"("texture f" "absent")"), {"test.pbrt:3", "\"absent\" is not defined"}));
  EXPECT_TRUE(
      mentions(error_of(R"(Texture "s" "spectrum" "constant")", R"("texture f" "s")"), {"is a spectrum texture"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "s" "float" "constant")", R"("texture c" "s")"), {"is a float texture"}));
  EXPECT_TRUE(mentions(error_of("", R"("string f" "x")"), {"expected float or texture"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "spectrum" "imagemap")"), {"no \"string filename\""}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "spectrum" "imagemap" "string filename" "none.png")"),
                       {"test.pbrt:2", "none.png"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "checkerboard" "integer dimension" 4)"), {"2 or 3"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "fbm" "integer octaves" 2000000000)"), {"octaves", "64"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "dots" "string mapping" "cubic")"), {"cubic", "cylindrical"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "directionmix" "vector3 dir" [0 0 0])"), {"dir"}));
}

TEST(TextureLibrary, CyclesAreUseBeforeDefinition) {
  const std::string e = error_of(
      "Texture \"a\" \"float\" \"scale\" \"texture tex\" \"b\"\n"
      "Texture \"b\" \"float\" \"scale\" \"texture tex\" \"a\"\n");
  EXPECT_TRUE(mentions(e, {"test.pbrt:2", "\"b\" is used before its definition at test.pbrt:3"})) << e;
  EXPECT_TRUE(mentions(error_of(R"(Texture "a" "float" "scale" "texture tex" "a")"), {"used before its definition"}));
}

TEST(TextureLibrary, UnusedParametersAreReported) {
  const TestScene scene(R"(Texture "t" "float" "constant" "float valeu" 2)");
  ASSERT_EQ(scene.diagnostics.count(), 1u);
  EXPECT_TRUE(mentions(scene.diagnostics.messages()[0], {"valeu"})) << scene.diagnostics.messages()[0];
}

TEST(TextureLibrary, Images) {
  const test::TemporaryFolder folder;
  image::OutputImage picture;
  picture.width = picture.height = 2;
  picture.layers = {{"", {"R", "G", "B"}, {0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0, 0}, {}}};  // green above red
  image::write_png(folder.file("a.png"), picture);
  const TestScene scene(R"(
    Texture "c" "spectrum" "imagemap" "string filename" "a.png" "string filter" "point"
    Texture "f" "float" "imagemap" "string filename" "a.png" "float scale" 3 "bool invert" true)",
                        R"("texture c" "c" "texture f" "f")", false, folder.path().string());
  const auto c = scene.library.reflectance_texture(scene.params(), "c", RGB(0));
  EXPECT_EQ(value_at(*c, 0.25f, 0.25f), RGB(1, 0, 0));
  EXPECT_EQ(value_at(*c, 0.25f, 0.75f), RGB(0, 1, 0));
  EXPECT_EQ(scene.library.float_texture(scene.params(), "f", 0)->constant(), 0);
  const auto n = scene.library.normal_map("a.png", {});
  EXPECT_EQ(value_at(*n, 0.25f, 0.25f), RGB(1, 0, 0));
  EXPECT_EQ(scene.library.light_image("a.png", {}).width(), 2);
  EXPECT_THROW(scene.library.normal_map("b.png", {}), InputError);
  EXPECT_THROW(scene.library.light_image("b.png", {}), InputError);
}

TEST(TextureLibrary, KeepGoingShowsStandIns) {
  const TestScene scene(R"(
    Texture "c" "spectrum" "imagemap" "string filename" "none.png"
    Texture "f" "float" "imagemap" "string filename" "none.png")",
                        R"("texture c" "c" "texture f" "f")", true);
  EXPECT_EQ(scene.diagnostics.count(), 2u);
  EXPECT_TRUE(mentions(scene.diagnostics.messages()[0], {"none.png", "magenta"})) << scene.diagnostics.messages()[0];
  EXPECT_EQ(value_at(*scene.library.reflectance_texture(scene.params(), "c", RGB(0)), 0.05f, 0.05f), RGB(1, 0, 1));
  EXPECT_EQ(scene.library.float_texture(scene.params(), "f", 0)->constant(), 1);
  EXPECT_EQ(scene.library.normal_map("none.png", {})->constant(), RGB(.5f, .5f, 1));
  EXPECT_EQ(scene.library.light_image("none.png", {}).rgb(0, 0), RGB(1, 0, 1));
}

}  // namespace
}  // namespace dapple::build
