// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/small_bodies.h"

#include <gtest/gtest.h>

#include "dapple/build/integrator_factory.h"
#include "dapple/path/path_integrator.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::build_text;

std::string wax(double free_path, const std::string& more = "") {
  return "Material \"subsurface\" \"rgb reflectance\" [ .6 .5 .4 ] \"rgb mfp\" [ " + std::to_string(free_path) +
         " 0.01 0.01 ] \"float roughness\" 0 " + more + "\n";
}

std::string world(const std::string& shapes) {
  return "LookAt 0 -4 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 30\nFilm \"rgb\" \"integer xresolution\" "
         "24 "
         "\"integer yresolution\" 24 \"bool savefp16\" false\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 "
         "]\n" +
         shapes;
}

std::vector<bool> small(const std::string& shapes) {
  const build::BuiltScene built = build_text(world(shapes));
  const std::vector<uint8_t> found = distribution::find_small_bodies(*built.scene);
  return {found.begin(), found.end()};
}

const std::string ball = "Shape \"sphere\" \"float radius\" 1\n";
const std::string small_ball = "Shape \"sphere\" \"float radius\" 0.1\n";
// Two sides of a cube of 2 m.
const std::string sides =
    "Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 -1  1 -1 -1  -1 -1 1  1 -1 1 ]\n"
    "Shape \"bilinearmesh\" \"point3 P\" [ -1 1 -1  1 1 -1  -1 1 1  1 1 1 ]\n";

TEST(SmallBodies, AreThoseOfFewFreePaths) {
  EXPECT_EQ(small(wax(.03) + ball), std::vector<bool>{false});
  EXPECT_EQ(small(wax(.05) + ball), std::vector<bool>{true});
  EXPECT_EQ(small(wax(.03) + small_ball), std::vector<bool>{true});
  EXPECT_EQ(small("Material \"diffuse\"\n" + small_ball), std::vector<bool>{false});
}

TEST(SmallBodies, AreWholeBodies) {
  EXPECT_EQ(small(wax(.03) + sides), (std::vector<bool>{false, false}));
  EXPECT_EQ(small(wax(.05) + sides), (std::vector<bool>{true, true}));
  EXPECT_EQ(small(wax(.03) + small_ball + wax(.03) + ball), (std::vector<bool>{true, false}));
}

TEST(SmallBodies, AreMeasuredWhereTheyArePlacedLargest) {
  const std::string object = "ObjectBegin \"o\"\n" + wax(.03) + ball + "ObjectEnd\n",
                    at = " ObjectInstance \"o\" AttributeEnd\n";
  EXPECT_EQ(small(object + "AttributeBegin Scale .1 .1 .1" + at), std::vector<bool>{true});
  EXPECT_EQ(small(object + "AttributeBegin Scale .1 .1 .1" + at + "AttributeBegin Scale .1 .1 2" + at),
            std::vector<bool>{false});
}

TEST(SmallBodies, OfUnknownFreePathsCountAsLarge) {
  EXPECT_EQ(
      small("Texture \"t\" \"spectrum\" \"checkerboard\"\nMaterial \"subsurface\" \"rgb reflectance\" [ .5 .5 .5 ] "
            "\"texture mfp\" \"t\"\n" +
            ball),
      std::vector<bool>{false});
}

// Diffusion makes it a fifth too dark.
TEST(SmallBodies, AreWalkedThrough) {
  const build::BuiltScene built =
      build_text(world("Material \"subsurface\" \"rgb reflectance\" [ .6 .5 .4 ] \"rgb mfp\" [ .1 .1 .1 ]\n" + ball));
  build::IntegratorRequest request;
  request.type = "distribution";
  const auto made = build::make_integrator(*built.scene, request, 64, 0);
  EXPECT_NE(dynamic_cast<const path::PathIntegrator*>(made.get()), nullptr);
  const RGB walked = test::render_built(built, 64, *made).mean(),
            expected = test::render_built(built, 512, test::bounces(4)).mean();
  test::expect_near(walked, expected, 0.02f, "a walk");
  request.visible_points = distribution::VisiblePoints::grids;
  const RGB diffused = test::render_built(built, 16, *build::make_integrator(*built.scene, request, 16, 0)).mean();
  EXPECT_LT(diffused.luminance(), 0.95f * expected.luminance());
}

}  // namespace
}  // namespace dapple
