// SPDX-License-Identifier: Apache-2.0
// Colours of leaves that a picture's alpha cuts out. The pictures: leaf.png is the coverage; rgba.png has it as its
// alpha, and is black where nothing is; bled.png has the same colours and goes on with them beyond the leaf's edge.
#include <gtest/gtest.h>

#include "dapple/image/image_writer.h"
#include "tests/image/temporary_folder.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::render_text;

const std::string pictures = DAPPLE_SOURCE_DIR "/tests/integrate/leaf/";

std::string imagemap(const std::string& name, const std::string& file, const std::string& more = {}) {
  const bool alpha = name == "a";
  return "Texture \"" + name + "\" \"" + (alpha ? "float" : "spectrum") + "\" \"imagemap\" \"string filename\" \"" +
         file + "\"" + (alpha ? " \"string encoding\" \"linear\" " : " ") + more + "\n";
}

// A plane seen from above under an even sky of 1, so many pictures across; it shows reflectance times what is there.
std::string plane(int tiles, const std::string& textures, const std::string& reflectance,
                  const std::string& cut = "\"texture alpha\" \"a\"") {
  const std::string n = std::to_string(tiles / 2);
  return "LookAt 0 0 3  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -" + n + " " + n + " -" + n +
         " " + n + " ]\n" + R"(
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
)" + textures +
         "Material \"diffuse\" " + reflectance + R"(
Shape "trianglemesh" "point3 P" [ -100 -100 0 100 -100 0 100 100 0 -100 100 0 ] "point2 uv" [ -100 -100 100 -100 100 100 -100 100 ] "integer indices" [ 0 1 2 0 2 3 ] )" +
         cut + R"(
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
Translate 0 0 -1 Scale 200 200 1
Shape "bilinearmesh" "point3 P" [ -1 -1 0 1 -1 0 -1 1 0 1 1 0 ]
)";
}

template <class Settings>
RGB colour_of_what_is_there(int tiles, const std::string& textures,
                            const std::string& cut = "\"texture alpha\" \"a\"") {
  Settings settings;
  if constexpr (std::is_same_v<Settings, path::PathIntegrator::Settings>)
    settings.diffuse_bounces = 0;
  else
    settings.shading.bounces = 0;
  const RGB leaf = render_text(plane(tiles, textures, "\"texture reflectance\" \"c\"", cut), 64, settings).mean();
  const RGB white = render_text(plane(tiles, textures, "\"rgb reflectance\" [ 1 1 1 ]", cut), 64, settings).mean();
  return leaf / white;
}

// What the picture has where the leaf is, times coverage over coverage.
RGB right_colour() {
  const image::Image picture = image::read_image(pictures + "rgba.png", {});
  double sum[4] = {0, 0, 0, 0};
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      for (int c = 0; c < 4; ++c)
        sum[c] += double(picture.pixel(x, y)[c]) * (c < 3 ? double(picture.pixel(x, y)[3]) : 1);
  return {float(sum[0] / sum[3]), float(sum[1] / sum[3]), float(sum[2] / sum[3])};
}

using distribution::DistributionIntegrator;
using path::PathIntegrator;

// Expectation: the same colour from far and near; 1 % is for samples at the leaf's edge (64 a pixel, 1024 pixels).
TEST(LeafColour, IsTheSameAtEveryDistance) {
  const std::string textures = imagemap("a", pictures + "leaf.png") + imagemap("c", pictures + "rgba.png");
  for (const int tiles : {2, 4, 32, 100}) {
    test::expect_near(colour_of_what_is_there<PathIntegrator::Settings>(tiles, textures), right_colour(), 0.01f,
                      "path, " + std::to_string(tiles));
    test::expect_near(colour_of_what_is_there<DistributionIntegrator::Settings>(tiles, textures), right_colour(), 0.01f,
                      "distribution, " + std::to_string(tiles));
  }
}

// The colours have no alpha of their own: it is the shape's picture that says what is there. Through a chain of
// textures as well.
TEST(LeafColour, TakesTheShapesAlpha) {
  test::TemporaryFolder folder;
  const image::Image rgba = image::read_image(pictures + "rgba.png", {});
  const image::Image rgb = rgba.select(std::array{0, 1, 2});
  image::OutputImage out;
  out.width = rgb.width(), out.height = rgb.height();
  out.layers = {{"", rgb.channel_names(), {rgb.pixels().begin(), rgb.pixels().end()}, {}}};
  const std::string file = folder.file("rgb.exr");
  image::write_exr(file, out, {});
  const std::string alpha = imagemap("a", pictures + "leaf.png");
  const RGB right = right_colour();
  for (const int tiles : {2, 32, 100}) {
    const std::string what = std::to_string(tiles);
    test::expect_near(colour_of_what_is_there<PathIntegrator::Settings>(tiles, alpha + imagemap("c", file)), right,
                      0.012f, "path " + what);
    test::expect_near(colour_of_what_is_there<DistributionIntegrator::Settings>(tiles, alpha + imagemap("c", file)),
                      right, 0.012f, "distribution " + what);
  }
  const std::string chain =
      alpha + imagemap("b", file) + "Texture \"c\" \"spectrum\" \"scale\" \"texture tex\" \"b\" \"float scale\" .5\n";
  test::expect_near(colour_of_what_is_there<PathIntegrator::Settings>(100, chain), right * 0.5f, 0.012f, "chain");
  // `opacity` is coverage too.
  const std::string opacity = "Texture \"o\" \"spectrum\" \"imagemap\" \"string filename\" \"" + pictures +
                              "leaf.png\" \"string encoding\" \"linear\"\n" + imagemap("c", file);
  test::expect_near(colour_of_what_is_there<PathIntegrator::Settings>(32, opacity, "\"texture opacity\" \"o\""), right,
                    0.012f, "opacity");
  // The other meaning, and another mapping, where texels do not lie upon each other: darker from afar.
  for (const std::string more : {"\"bool weightbyalpha\" false", "\"float udelta\" .5"})
    EXPECT_LT(colour_of_what_is_there<PathIntegrator::Settings>(100, alpha + imagemap("c", file, more)).g,
              0.6f * right.g)
        << more;
}

}  // namespace
}  // namespace dapple
