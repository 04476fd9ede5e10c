// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/texture_factory.h"

#include <gtest/gtest.h>

#include "dapple/image/image_writer.h"
#include "dapple/image/texture_system.h"
#include "tests/image/temporary_folder.h"
#include "tests/pattern/texture_points.h"

namespace dapple::build {
namespace {

using pattern::test::value_at;

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

/// The value of the float texture "t" at u, v.
float float_value(const std::string& textures, float u = 0.3f, float v = 0.4f) {
  const TestScene scene(textures, R"("texture f" "t")");
  EXPECT_EQ(scene.diagnostics.count(), 0u) << textures;
  return value_at(*scene.library.float_texture(scene.params(), "f", 0), u, v);
}
RGB color_value(const std::string& textures, float u = 0.3f, float v = 0.4f) {
  const TestScene scene(textures, R"("texture c" "t")");
  EXPECT_EQ(scene.diagnostics.count(), 0u) << textures;
  return value_at(*scene.library.reflectance_texture(scene.params(), "c", RGB(0)), u, v);
}

TEST(PatternNodes, Arithmetic) {
  const std::string u = R"(Texture "u" "float" "coordinate")";
  const auto value = [&](const std::string& type, const std::string& parameters) {
    return float_value(u + " Texture \"t\" \"float\" \"" + type + "\" " + parameters);
  };
  const std::string both = R"("texture in1" "u" "float in2" 2)", in = R"("texture in" "u")";
  EXPECT_FLOAT_EQ(value("add", both), 2.3f);
  EXPECT_FLOAT_EQ(value("subtract", both), -1.7f);
  EXPECT_FLOAT_EQ(value("multiply", both), 0.6f);
  EXPECT_FLOAT_EQ(value("divide", both), 0.15f);
  EXPECT_NEAR(value("modulo", R"("float in1" 7.3 "texture in2" "u")"), 0.1f, 1e-6f);
  EXPECT_FLOAT_EQ(value("power", both), 0.09f);
  EXPECT_FLOAT_EQ(value("min", both), 0.3f);
  EXPECT_FLOAT_EQ(value("max", both), 2);
  EXPECT_FLOAT_EQ(value("atan2", both), std::atan2(0.3f, 2.0f));
  EXPECT_FLOAT_EQ(value("abs", R"("float in" -4)"), 4);
  EXPECT_FLOAT_EQ(value("floor", in), 0);
  EXPECT_FLOAT_EQ(value("fract", in), 0.3f);
  EXPECT_FLOAT_EQ(value("sqrt", in), std::sqrt(0.3f));
  EXPECT_FLOAT_EQ(value("exp", in), std::exp(0.3f));
  EXPECT_FLOAT_EQ(value("ln", in), std::log(0.3f));
  EXPECT_FLOAT_EQ(value("sin", in), std::sin(0.3f));
  EXPECT_FLOAT_EQ(value("cos", in), std::cos(0.3f));
  EXPECT_FLOAT_EQ(value("invert", in), 0.7f);
  EXPECT_FLOAT_EQ(value("clamp", in + R"("float high" .2)"), 0.2f);
  EXPECT_FLOAT_EQ(value("smoothstep", in + R"("float high" .6)"), 0.5f);
  EXPECT_FLOAT_EQ(value("remap", in + R"("float inlow" .1 "float outlow" 10 "float outhigh" 19)"), 12);
  EXPECT_FLOAT_EQ(value("contrast", in + R"("float amount" 2)"), 0.1f);
  EXPECT_FLOAT_EQ(value("select", R"("texture which" "u" "float in1" 5 "float in2" 6)"), 6);
  EXPECT_FLOAT_EQ(value("ifgreater", R"("texture value1" "u" "float value2" .2 "float in1" 5 "float in2" 6)"), 5);
  EXPECT_FLOAT_EQ(value("ramp", in + R"("float positions" [0 .2 .4] "float values" [1 2 4])"), 3);
  EXPECT_FLOAT_EQ(
      value("ramp", in + R"("float positions" [0 .4] "float values" [1 2] "string interpolation" "constant")"), 1);
  EXPECT_FLOAT_EQ(value("ramp", in), 0.3f);
}

TEST(PatternNodes, Colours) {
  const std::string u =
      R"(Texture "u" "float" "coordinate" Texture "c" "spectrum" "combine3" "texture in1" "u" "float in2" .5 "float in3" .2 )";
  const auto value = [&](const std::string& type, const std::string& parameters) {
    return color_value(u + " Texture \"t\" \"spectrum\" \"" + type + "\" " + parameters);
  };
  EXPECT_EQ(value("add", R"("texture in1" "c" "float in2" 0)"), RGB(.3f, .5f, .2f));
  const RGB scaled = value("multiply", R"("texture in1" "c" "rgb in2" [3 1 2])");  // not clamped as a reflectance
  EXPECT_FLOAT_EQ(scaled.r, .9f);
  EXPECT_FLOAT_EQ(scaled.b, .4f);
  EXPECT_FLOAT_EQ(value("multiply", R"("texture in1" "c" "texture in2" "u")").g, .15f);
  EXPECT_NEAR(value("hsv", R"("rgb in" [1 0 0] "float hue" .33333333)").g, 1, 1e-5f);
  EXPECT_EQ(value("saturate", R"("rgb in" [0 1 0] "float amount" 0)"), RGB(.7152f));
  const RGB ramp = value("ramp", R"("texture in" "u" "float positions" [0 .6] "rgb values" [1 0 0  0 0 1])");
  EXPECT_NEAR(ramp.r, .5f, 1e-6f);
  EXPECT_NEAR(ramp.b, .5f, 1e-6f);
  EXPECT_FLOAT_EQ(float_value(u + R"(Texture "t" "float" "luminance" "texture in" "c")"),
                  RGB(.3f, .5f, .2f).luminance());
  EXPECT_EQ(float_value(u + R"(Texture "t" "float" "extract" "texture in" "c" "integer index" 1)"), .5f);
}

TEST(PatternNodes, NoiseAndCoordinates) {
  const std::string at =
      R"(Texture "x" "float" "coordinate" "string which" "u" Texture "y" "float" "coordinate" "string which" "v" )";
  for (const std::string type : {"perlin", "simplex", "worley", "cellular", "turbulence", "fbm", "windy"}) {
    const std::string node =
        "Texture \"t\" \"float\" \"" + type + "\" \"texture x\" \"x\" \"texture y\" \"y\" \"float z\" .4";
    EXPECT_NE(float_value(at + node, 0.3f, 0.4f), float_value(at + node, 0.6f, 0.1f)) << type;
  }
  const std::string scaled =
      at + R"(Texture "t" "float" "perlin" "texture x" "x" "float y" 0 "float z" .5 "float scale" 2)";
  const std::string plain =
      at +
      R"(Texture "t" "float" "perlin" "texture x" "x" "float y" 0 "float z" 1 "float amplitude" 2 "float pivot" 10)";
  EXPECT_FLOAT_EQ(float_value(scaled, 0.3f), (float_value(plain, 0.6f) - 10) / 2);
  const std::string moved = "Translate 1 0 0\n";
  const TestScene scene(moved + R"(Texture "t" "float" "coordinate" "string which" "x"
    Texture "w" "float" "coordinate" "string which" "x" "string space" "world"
    Texture "n" "float" "coordinate" "string which" "nz")",
                        R"("texture f" "t" "texture g" "w" "texture h" "n")");
  const auto value = [&](const char* name) {
    return value_at(*scene.library.float_texture(scene.params(), name, 0), V3f(3, 2, 1));
  };
  EXPECT_EQ(value("f"), 2);
  EXPECT_EQ(value("g"), 3);
  EXPECT_LE(std::abs(value("h")), 1);
}

TEST(PatternNodes, ImagesFollowComputedCoordinates) {
  const test::TemporaryFolder folder;
  image::OutputImage picture;
  picture.width = picture.height = 2;
  picture.layers = {{"", {"R", "G", "B"}, {0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0, 0}, {}}};  // green above red
  image::write_png(folder.file("a.png"), picture);
  const TestScene scene(R"(
    Texture "u" "float" "coordinate"
    Texture "c" "spectrum" "imagemap" "string filename" "a.png" "string filter" "point" "float s" .5 "texture t" "u")",
                        R"("texture c" "c")", false, folder.path().string());
  const auto c = scene.library.reflectance_texture(scene.params(), "c", RGB(0));
  EXPECT_EQ(value_at(*c, 0.25f, 0.25f), RGB(1, 0, 0));
  EXPECT_EQ(value_at(*c, 0.75f, 0.25f), RGB(0, 1, 0));
}

TEST(PatternNodes, ErrorsSayWhatIsExpected) {
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "perlinn")"), {"perlin", "worley", "smoothstep"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "ramp" "float positions" [0 1] "float values" [1])"),
                       {"test.pbrt:2", "as many"}));
  EXPECT_TRUE(
      mentions(error_of(R"(Texture "t" "float" "ramp" "float positions" [1 0] "float values" [1 2])"), {"ascend"}));
  EXPECT_TRUE(
      mentions(error_of(R"(Texture "t" "spectrum" "ramp" "float positions" [1 2] "float values" [1 2])"), {"rgb"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "worley" "float jitter" 2)"), {"jitter", "0 to 1"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "worley" "string output" "f3")"), {"f3", "edge"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "coordinate" "string which" "w")"), {"nx"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "extract" "integer index" 3)"), {"index"}));
  EXPECT_TRUE(mentions(error_of(R"(Texture "t" "float" "add" "rgb in1" [1 1 1])"), {"expected float or texture"}));
}

TEST(PatternNodes, ChainsOfAHundredThousand) {
  for (const std::string kind : {"float", "spectrum"}) {
    std::string text = "Texture \"n0\" \"" + kind + "\" \"checkerboard\"\n";
    constexpr int n = 100000;
    for (int i = 1; i <= n; ++i)
      text += "Texture \"n" + std::to_string(i) + "\" \"" + kind + "\" \"add\" \"texture in1\" \"n" +
              std::to_string(i - 1) + "\" \"float in2\" 1e-5\n";
    const std::string last = "n" + std::to_string(n);
    const TestScene scene(text, "\"texture " + std::string(kind == "float" ? "f" : "c") + "\" \"" + last + "\"");
    if (kind == "float")
      EXPECT_NEAR(value_at(*scene.library.float_texture(scene.params(), "f", 0), 0.3f, 0.4f), 2, 0.01f);
    else
      EXPECT_NEAR(value_at(*scene.library.reflectance_texture(scene.params(), "c", RGB(0)), 0.3f, 0.4f).g, 2, 0.01f);
  }
}

// Each noise needs the width of the one that warps it: programs must grow with the number of noises, not with two or
// three to its power.
TEST(PatternNodes, NoisesThatWarpNoises) {
  std::string text = "Texture \"n0\" \"float\" \"perlin\"\n";
  for (int i = 1; i < 60; ++i) {
    const char* const kind = i % 3 == 0 ? "worley" : i % 3 == 1 ? "perlin" : "fbm";
    text += "Texture \"n" + std::to_string(i) + "\" \"float\" \"" + kind + "\" \"texture x\" \"n" +
            std::to_string(i - 1) + "\"\n";
  }
  const TestScene scene(text, R"("texture f" "n59")");
  EXPECT_TRUE(std::isfinite(value_at(*scene.library.float_texture(scene.params(), "f", 0), 0.3f, 0.4f)));
}

TEST(TextureLibrary, TexturesAreCompiledOnce) {
  const TestScene scene(R"(Texture "a" "float" "fbm" Texture "b" "float" "fbm")", R"("texture f" "a" "texture g" "b")");
  EXPECT_EQ(scene.library.float_texture(scene.params(), "f", 0), scene.library.float_texture(scene.params(), "g", 0));
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

// What an image scaled above 1 is mixed with sees no more than 1 of it, where it is a reflectance.
TEST(TextureLibrary, ReflectancesOfImagesEndAtOne) {
  const test::TemporaryFolder folder;
  image::OutputImage picture;
  picture.width = picture.height = 1;
  picture.layers = {{"", {"R", "G", "B"}, {.5f, .5f, .5f}, {}}};
  image::write_png(folder.file("a.png"), picture);
  const TestScene scene(R"(
    Texture "c" "spectrum" "imagemap" "string filename" "a.png" "float scale" 40
    Texture "half" "spectrum" "mix" "texture tex1" "c" "rgb tex2" [ .6 .6 .6 ] "float amount" .5)",
                        R"("texture c" "c" "texture half" "half")", false, folder.path().string());
  EXPECT_EQ(scene.library.reflectance_texture(scene.params(), "c", RGB(0))->constant(), RGB(1));
  EXPECT_NEAR(scene.library.reflectance_texture(scene.params(), "half", RGB(0))->constant()->g, 0.8f, 1e-6f);
  EXPECT_GT(scene.library.unbounded_texture(scene.params(), "c", RGB(0))->constant()->g, 5);
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
