// SPDX-License-Identifier: Apache-2.0
// Layered materials and hair in whole renders: `path` and `distribution` show the same.
#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

RGB mean_by_path(const build::BuiltScene& built, int bounces, int samples) {
  path::PathIntegrator::Settings s;
  s.diffuse_bounces = bounces;
  return test::render_built(built, samples, s).mean();
}

RGB mean_by_distribution(const build::BuiltScene& built, int bounces) {
  distribution::DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = {16};
  s.shading.diffuse_rays = {64, 16};
  return test::render_built(built, 16, s).mean();
}

std::string room(const std::string& material) {
  return R"(LookAt 0 -4 1.4  0 0 .6  0 0 1
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 48 "integer yresolution" 48
WorldBegin
LightSource "infinite" "rgb L" [ .4 .5 .6 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 12 10 8 ]
ReverseOrientation
Shape "bilinearmesh" "point3 P" [ -2 -1 3  0 -1 3  -2 1 3  0 1 3 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .5 .4 ]
Shape "bilinearmesh" "point3 P" [ 1.2 -2 0  1.2 2 0  1.2 -2 2  1.2 2 2 ]
Material )" +
         material +
         R"(
Shape "bilinearmesh" "point3 P" [ -5 -5 0  5 -5 0  -5 5 0  5 5 0 ]
Translate 0 0 .6
Shape "sphere" "float radius" .6
)";
}

// The floor sees the ball and the wall, so that diffuse rays meet the material too. Bound 1 %, the noise of both in it.
TEST(PrincipledScenes, DistributionIsPath) {
  for (
      const char* material :
      {R"("openpbr" "rgb base_color" [ .7 .3 .1 ])",
       R"("openpbr" "rgb base_color" [ .7 .3 .1 ] "float base_diffuse_roughness" 1 "float specular_roughness" .1)",
       R"("openpbr" "rgb base_color" [ .7 .3 .1 ] "float coat_weight" .8 "rgb coat_color" [ .9 .7 .5 ] "float coat_roughness" .4)",
       R"("openpbr" "rgb base_color" [ .7 .3 .1 ] "float fuzz_weight" 1 "rgb fuzz_color" [ .8 .8 1 ])",
       R"("openpbr" "rgb base_color" [ .7 .3 .1 ] "float thin_film_weight" 1 "float thin_film_thickness" .3 "float thin_film_ior" 2)",
       R"("openpbr" "rgb base_color" [ .1 .1 .1 ] "float specular_weight" 0 "float thin_film_weight" 1 "float thin_film_thickness" .4 "float thin_film_ior" 2)",
       R"("openpbr" "rgb base_color" [ .9 .7 .4 ] "float base_metalness" .7 "float specular_roughness" .5)",
       R"("openpbr" "rgb base_color" [ .7 .3 .1 ] "bool geometry_thin_walled" true "float subsurface_weight" .7)"}) {
    const auto built = test::build_text(room(material));
    test::expect_near(mean_by_distribution(built, 1), mean_by_path(built, 1, 1024), 0.01f, material);
  }
}

// What shines by its material is an area light: a ball of 683 cd/m^2 has radiance 1.
TEST(PrincipledScenes, EmissionIsLight) {
  const char* scene = R"(LookAt 0 -4 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [ -.1 .1 -.1 .1 ]
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
Material "openpbr" "float base_weight" 0 "float specular_weight" 0 "float emission_luminance" 683 "rgb emission_color" [ 1 .5 .25 ]
Shape "sphere"
)";
  const auto built = test::build_text(scene);
  EXPECT_EQ(built.scene->lights.size(), 1u);
  const RGB seen = mean_by_path(built, 1, 4);
  EXPECT_NEAR(seen.r, 1, 1e-4f);
  EXPECT_NEAR(seen.g, 0.5f, 1e-4f);
  EXPECT_NEAR(seen.b, 0.25f, 1e-4f);
}

// Half as opaque as the same ball: half of the black background.
TEST(PrincipledScenes, OpacityCutsOut) {
  const auto at = [](const char* opacity) {
    const std::string scene = std::string(R"(LookAt 0 -4 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [ -.1 .1 -.1 .1 ]
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "distant" "point3 from" [ 0 -1 0 ] "point3 to" [ 0 0 0 ]
Material "openpbr" "float specular_weight" 0 "float geometry_opacity" )") +
                              opacity + "\nShape \"bilinearmesh\" \"point3 P\" [ -1 0 -1  1 0 -1  -1 0 1  1 0 1 ]\n";
    return mean_by_path(test::build_text(scene), 0, 256).g;
  };
  EXPECT_NEAR(at("0.5") / at("1"), 0.5f, 0.02f);
}

/// 300 of them, upright, of one kind of curves.
std::string strands_of(const char* type, float width) {
  std::string strands;
  KeyedRng rng(4);
  for (int i = 0; i < 300; ++i) {
    const float x = 2 * rng.next() - 1, y = 2 * rng.next() - 1, lean = rng.next() - 0.5f;
    char text[400];
    std::snprintf(text, sizeof text,
                  "Shape \"curve\" \"string type\" \"%s\" \"float width\" %g \"normal N\" [ 0 -1 0  0 -1 0 ] "
                  "\"point3 P\" [ %g %g 0  %g %g .4  %g %g .8  %g %g 1 ]\n",
                  type, double(width), double(x), double(y), double(x), double(y), double(x + lean / 2), double(y),
                  double(x + lean), double(y - lean));
    strands += text;
  }
  return strands;
}

constexpr char strands_view[] = R"(LookAt 0 -4 1.4  0 0 .5  0 0 1
Camera "perspective" "float fov" 30
Film "rgb" "integer xresolution" 40 "integer yresolution" 40
WorldBegin
LightSource "distant" "rgb L" [ 2 2 2 ] "point3 from" [ -1 -1 2 ] "point3 to" [ 0 0 0 ]
)";

// Strands on a floor, all kinds of curves.
TEST(PrincipledScenes, HairDistributionIsPath) {
  for (const char* type : {"flat", "cylinder", "ribbon"}) {
    const auto built = test::build_text(strands_view + std::string(R"(LightSource "infinite" "rgb L" [ .4 .5 .6 ]
Material "diffuse" "rgb reflectance" [ .4 .4 .4 ]
Shape "bilinearmesh" "point3 P" [ -5 -5 0  5 -5 0  -5 5 0  5 5 0 ]
Material "hair" "float eumelanin" .4
)") + strands_of(type, 0.04f));
    test::expect_near(mean_by_distribution(built, 1), mean_by_path(built, 1, 1024), 0.012f, type);
  }
}

// About as wide as a pixel, in the sun alone: tubes have a bright and a dark side there, and of what is seen of a
// ribbon the middle may be hidden, and in shadow.
TEST(PrincipledScenes, CurvesInTheSunAreThoseOfPath) {
  for (const char* type : {"flat", "cylinder", "ribbon"}) {
    const auto built =
        test::build_text(strands_view + std::string("Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n") +
                         strands_of(type, 0.04f));
    distribution::DistributionIntegrator::Settings s;
    s.shading.bounces = 0;
    s.shading.shadow_rays = {16};
    test::expect_near(test::render_built(built, 128, s).mean(), mean_by_path(built, 0, 512), 0.008f, type);
  }
}

// Straight through a ball of index 1: two metres of what keeps its colour over two.
TEST(PrincipledScenes, ColourByDepthIsBeersLaw) {
  for (const char* more : {"", "\"float specular_weight\" 0"}) {
    const auto built = test::build_text(R"(LookAt 0 -4 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [ -.01 .01 -.01 .01 ]
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "openpbr" "float transmission_weight" 1 "float specular_ior" 1 "rgb transmission_color" [ .9 .5 .1 ]
"float transmission_depth" 2 "float specular_roughness" 0 )" +
                                        std::string(more) + "\nShape \"sphere\" \"float radius\" 1\n");
    for (const RGB& mean : {mean_by_path(built, 1, 64), mean_by_distribution(built, 1)})
      test::expect_near(mean, RGB(0.9f, 0.5f, 0.1f), 0.002f, more);
  }
}

}  // namespace
}  // namespace dapple
