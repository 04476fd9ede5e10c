// SPDX-License-Identifier: Apache-2.0
// A curve shaped like an S, seen face on by a parallel camera, against areas and radiances known in closed form.
#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::bounces;
using test::expect_near;
using test::render_text;

constexpr float width = 0.3f, window = 2.4f;
constexpr int pixels = 120;

std::string scene(const std::string& material, const std::string& curve, const std::string& place = "") {
  return R"(LookAt 0 -9 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [ -1.2 1.2 -1.2 1.2 ]
Film "rgb" "integer xresolution" 120 "integer yresolution" 120
PixelFilter "box"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
)" + material +
         "\n" + place +
         R"(Shape "curve" "point3 P" [ -.8 0 -.8  -.8 0 1.2  .8 0 -1.2  .8 0 .8 ] "float width" .3 "string type" )" +
         curve;
}

const std::string curves[] = {R"("flat")", R"("ribbon" "normal N" [ 0 -1 0  0 -1 0 ])", R"("cylinder")"};
const std::string black = "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]";

/// A band whose middle bends less than it is wide covers its length times its width. As a share of the image.
double covered() {
  double length = 0;
  Imath::V2d last(-.8, -.8);
  for (int i = 1; i <= 1000; ++i) {
    const double t = i / 1000.0, s = 1 - t;
    const double b[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    const Imath::V2d p(-.8 * b[0] - .8 * b[1] + .8 * b[2] + .8 * b[3],
                       -.8 * b[0] + 1.2 * b[1] - 1.2 * b[2] + .8 * b[3]);
    length += (p - last).length();
    last = p;
  }
  return length * double(width) / (double(window) * double(window));
}

TEST(Curves, CoverTheirLengthTimesTheirWidth) {
  for (const std::string& curve : curves) {
    const double found = 1 - double(render_text(scene(black, curve), 16, bounces(0)).mean().g);
    // Flat ones are drawn as quads, which leave out a hundredth of the width here and there; round ends of tubes add to
    // them.
    EXPECT_NEAR(found / covered(), 1, 0.012) << curve;
  }
}

// Normals that turn from across to along: a ribbon that turns its edge to the camera, not a bar over the whole image.
TEST(Curves, RibbonsWhoseNormalRunsAlongThemStayNarrow) {
  const double found =
      1 - double(render_text(scene(black, R"("ribbon" "normal N" [ 0 -1 0  0 0 1 ])"), 16, bounces(0)).mean().g);
  EXPECT_GT(found / covered(), 0.5);
  EXPECT_LT(found / covered(), 1.01);
}

// What loses no light cannot be seen under an even sky: curves do not shade themselves where they are straight. In an
// instance as well.
TEST(Curves, WhiteOnesVanishUnderAnEvenSky) {
  const std::string white = "Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]";
  for (const std::string& curve : curves) {
    const auto film = render_text(scene(white, curve), 16, bounces(100, 100));
    const float on_it = (film.mean().g - 1 + float(covered())) / float(covered());
    EXPECT_NEAR(on_it, 1, 0.01) << curve;
    const auto moved =
        render_text(scene(white, curve + "\nObjectEnd\nRotate 20 0 1 0\nObjectInstance \"o\"\n", "ObjectBegin \"o\"\n"),
                    16, bounces(100, 100));
    EXPECT_NEAR((moved.mean().g - 1 + float(covered())) / float(covered()), 1, 0.01) << curve << " in an instance";
  }
}

// A checkerboard of 16 x 4 squares is half black, and not half grey.
TEST(Curves, ShowTheirTextures) {
  const std::string checks =
      R"(Texture "checks" "spectrum" "checkerboard" "float uscale" 16 "float vscale" 4 "rgb tex1" [ 0 0 0 ] "rgb tex2" [ 1 1 1 ]
Material "diffuse" "texture reflectance" "checks")";
  distribution::DistributionIntegrator::Settings distribution;
  distribution.shading.bounces = 0;
  for (const std::string& curve : curves) {
    const auto built = test::build_text(scene(checks, curve));
    const auto by_path = test::render_built(built, 16, bounces(0)),
               by_grids = test::render_built(built, 16, distribution);
    for (const auto* picture : {&by_path, &by_grids}) {
      int dark = 0;
      for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) dark += picture->film.pixel(x, y).g < 0.2f;
      const double share = dark / (double(pixels) * pixels * covered());
      // Pixels along the borders of a black square, of 9 x 4 pixels, are grey.
      EXPECT_GT(share, 0.2) << curve << (picture == &by_path ? " by path" : " by distribution");
      EXPECT_LT(share, 0.5) << curve << (picture == &by_path ? " by path" : " by distribution");
    }
  }
}

}  // namespace
}  // namespace dapple
