// SPDX-License-Identifier: Apache-2.0
// Whole renders whose result is known in closed form; the derivation stands above each test.
#include <gtest/gtest.h>

#include "dapple/path/ambient_occlusion.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::bounces;
using test::expect_near;
using test::render_text;

constexpr const char* film = R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
PixelFilter "box"
)";

// Inside a sphere that emits 1 and reflects a everywhere, radiance after n reflections is the geometric sum 1 + a + ...
// + a^n. With b bounces of indirect light the camera sees emission, direct light and b bounces: n = b + 1.
TEST(Furnace, SphereSumsTheGeometricSeries) {
  const std::string scene = std::string(film) + R"(Camera "spherical" "string mapping" "equirectangular"
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
ReverseOrientation
Shape "sphere" "float radius" 2
)";
  float expected = 1, power = 1;
  for (int b = 0; b < 4; ++b) {
    power *= .5f;
    expected += power;
    expect_near(render_text(scene, 64, bounces(b)).mean(), RGB(expected), .005f, std::to_string(b) + " bounces");
  }
  expect_near(render_text(scene, 64, bounces(100)).mean(), RGB(2), .005f, "all bounces");
}

// A convex white object under a uniform sky of radiance 1 shows radiance 1 everywhere: so does the sky.
struct FurnaceCase {
  const char* name;
  const char* material;
  float albedo;  ///< radiance expected where the object is, 1 where lossless
  float tolerance;
};

class UniformSky : public testing::TestWithParam<FurnaceCase> {};

TEST_P(UniformSky, HidesLosslessObjects) {
  const FurnaceCase& c = GetParam();
  const std::string scene = std::string(film) + R"(LookAt 0 -3 0  0 0 0  0 0 1
Camera "perspective" "float fov" 30
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
)" + c.material + R"(
Shape "sphere" "float radius" 1
)";
  expect_near(render_text(scene, 256, bounces(200, 200)).mean(), RGB(c.albedo), c.tolerance, c.name);
}

// At a field of view of 30 degrees from 3 m the unit sphere (half-angle 19.5 degrees) fills the square image but for
// the corners, where the sky shows: so cases with albedo below one are lossless ones scaled by eye-independent factors
// only in the sphere's part.
INSTANTIATE_TEST_SUITE_P(
    Materials, UniformSky,
    testing::Values(
        FurnaceCase{"diffuse", R"(Material "diffuse" "rgb reflectance" [ 1 1 1 ])", 1, .004f},
        FurnaceCase{"transmission",
                    R"(Material "diffusetransmission" "rgb reflectance" [ .5 .5 .5 ] "rgb transmittance" [ .5 .5 .5 ])",
                    1, .004f},
        FurnaceCase{"glass", R"(Material "dielectric" "float eta" 1.5)", 1, .004f},
        FurnaceCase{"thin", R"(Material "thindielectric" "float eta" 1.5)", 1, .004f},
        FurnaceCase{"mirror", R"(Material "conductor" "rgb reflectance" [ 1 1 1 ] "float roughness" 0)", 1, .02f},
        FurnaceCase{"interface", R"(Material "interface")", 1, .001f}),
    [](const auto& tested) { return std::string(tested.param.name); });

// A point light of intensity I at height h over a diffuse floor of reflectance rho: radiance below it is rho / pi * I /
// h^2.
TEST(DirectLight, PointLightFallsOffWithTheSquare) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 10  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.01 .01 -.01 .01 ]
WorldBegin
LightSource "point" "rgb I" [ 8 8 8 ] "point3 from" [ 0 0 2 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
  expect_near(render_text(scene, 4, bounces(0)).mean(), .5f * inv_pi * 8 / 4, .001f, "point light");
}

// A disk of radius R at height h, radiance L, facing a parallel surface below its centre: E = pi L R^2 / (R^2 + h^2).
TEST(DirectLight, DiskOverAPoint) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.01 .01 -.01 .01 ]
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 2 2 2 ]
  Translate 0 0 1  Rotate 180 1 0 0
  Shape "disk" "float radius" 1.5
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
  const float E = pi * 2 * 2.25f / (2.25f + 1);
  expect_near(render_text(scene, 256, bounces(0)).mean(), .5f * inv_pi * E, .005f, "disk");
}

// A rectangle a x b at height h with a corner over the point (Lambert's formula for the differential form factor):
// F = 1/(2 pi) (a/sqrt(h^2+a^2) atan(b/sqrt(h^2+a^2)) + b/sqrt(h^2+b^2) atan(a/sqrt(h^2+b^2))); E = pi L F.
TEST(DirectLight, RectangleOverAPoint) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.001 .001 -.001 .001 ]
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 3 3 3 ]
  Shape "trianglemesh" "integer indices" [ 0 2 1 0 3 2 ] "point3 P" [ 0 0 1  2 0 1  2 1 1  0 1 1 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
  const float a = 2, b = 1, ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  const float F = (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * pi);
  expect_near(render_text(scene, 256, bounces(0)).mean(), .5f * inv_pi * pi * 3 * F, .01f, "rectangle");
}

// A light that shines to one side is dark on the other: rounding puts points of it before or behind its own plane, from
// where it fills half of all directions.
TEST(DirectLight, BackOfALightIsDark) {
  for (const char* shape : {R"(Shape "bilinearmesh" "point3 P" [ -3.9 -1 1  -3.9 -1 3  -3.9 1 1  -3.9 1 3 ])",
                            R"(Shape "trianglemesh" "point3 P" [ -3.9 -2 0  -3.9 0 5  -3.9 2 0 ])",
                            R"(Rotate 90 0 1 0 Translate -2 0 -3.9 Scale 1 1 -1 Shape "disk" "float radius" 1)"}) {
    const std::string scene = std::string(film) + R"(LookAt 0 0 2  -3.9 0 2  0 0 1
Camera "perspective" "float fov" 14
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
)" + shape + "\n";
    EXPECT_EQ(render_text(scene, 64, bounces(2)).mean(), RGB()) << shape;
    distribution::DistributionIntegrator::Settings distribution;
    EXPECT_EQ(render_text(scene, 16, distribution).mean(), RGB()) << shape;
  }
}

// Two infinite parallel planes, the lower of reflectance a, the upper emitting 1 and reflecting b: the radiance of the
// lower plane is a (1 + b L): L = a / (1 - a b). Large planes stand in for infinite ones: the error is of order
// (distance / size)^2.
TEST(Interreflection, ParallelPlanes) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.1 .1 -.1 .1 ]
WorldBegin
AttributeBegin
  Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
  AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
  Shape "trianglemesh" "integer indices" [ 0 2 1 0 3 2 ] "point3 P" [ -500 -500 1  500 -500 1  500 500 1  -500 500 1 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .8 .8 .8 ]
Shape "bilinearmesh" "point3 P" [ -500 -500 0  500 -500 0  -500 500 0  500 500 0 ]
)";
  expect_near(render_text(scene, 1024, bounces(100)).mean(), .8f / (1 - .48f), .01f, "planes");
}

// Opacity alpha over a background: L = alpha * 0 + (1 - alpha) * sky for a black surface.
TEST(Opacity, HalfTransparentSurface) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ] "float alpha" .3
)";
  expect_near(render_text(scene, 256, bounces(0)).mean(), .7f, .01f, "alpha");
}

// Two black panes of opacities a and b, by channel, before a sky of 1: L = (1 - a) (1 - b). A white floor below them
// shows the same, lit by that sky or by a sun of irradiance pi. An interface between them changes nothing.
TEST(Opacity, DiffersByChannel) {
  const std::string panes = R"(
Texture "pane" "spectrum" "scale" "rgb tex" [ .8 .4 0 ] "float scale" .5
AttributeBegin
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -400 -400 3  400 -400 3  -400 400 3  400 400 3 ] "rgb opacity" [ 1 .5 .1 ] "float alpha" .5
Shape "bilinearmesh" "point3 P" [ -400 -400 2  400 -400 2  -400 400 2  400 400 2 ] "texture opacity" "pane"
AttributeEnd
)";
  const std::string interface =
      R"(AttributeBegin Material "interface" Shape "bilinearmesh" "point3 P" [ -400 -400 2.5  400 -400 2.5  -400 400 2.5  400 400 2.5 ] AttributeEnd
)";
  const std::string sky = std::string(film) + R"(LookAt 0 0 1  0 0 9  0 1 0
Camera "orthographic"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
)" + panes;
  const auto floor = [&](const std::string& light) {
    return std::string(film) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
)" + light +
           R"(
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)" + panes;
  };
  const std::string lit_by_sky = floor(R"(LightSource "infinite" "rgb L" [ 1 1 1 ])");
  const std::string sun = floor(
      R"(LightSource "distant" "rgb L" [ 3.14159265 3.14159265 3.14159265 ] "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ])");
  const RGB expected(0.5f * 0.6f, 0.75f * 0.8f, 0.95f);
  for (const std::string& scene : {sky, lit_by_sky, sun, sky + interface, lit_by_sky + interface, sun + interface}) {
    expect_near(render_text(scene, 1024, bounces(0)).mean(), expected, .01f, "path");
    distribution::DistributionIntegrator::Settings distribution;
    distribution.shading.bounces = 0;
    distribution.shading.shadow_rays = integrate::RayList{256};
    expect_near(render_text(scene, 1024, distribution).mean(), expected, .01f, "distribution of " + scene);
  }
  const auto built = test::build_text(lit_by_sky);
  for (const bool bleeding : {false, true}) {
    path::AmbientOcclusion::Settings occlusion;
    occlusion.color_bleeding = bleeding;
    expect_near(test::render_built(built, 64, path::AmbientOcclusion(*built.scene, occlusion)).mean(), expected, .01f,
                "ambient occlusion");
  }
}

// A quad that crosses the image at constant speed covers each pixel of its path for a share of the shutter time. It
// moves by its own width across a window of that width: mean coverage 1/2.
TEST(MotionBlur, TransformAndDeformationCoverAlike) {
  const std::string head = std::string(film) + R"(LookAt 0 0 5  0 0 0  0 1 0
Camera "orthographic" "float shutteropen" 0 "float shutterclose" 1
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
)";
  const std::string moving = R"(ActiveTransform EndTime
Translate 2 0 0
ActiveTransform All
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -3 -1 0  -1 -1 0  -1 1 0  -3 1 0 ]
)";
  const std::string deforming = R"(
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -3 -1 0  -1 -1 0  -1 1 0  -3 1 0 ]
  "point3 P1" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0 ]
)";
  expect_near(render_text(head + moving, 256, bounces(0)).mean(), .5f, .01f, "transform");
  expect_near(render_text(head + deforming, 256, bounces(0)).mean(), .5f, .01f, "deformation");
}

// An instance under a transform shows what the same shape shows when it is placed there: also if the transform mirrors.
TEST(Instances, LookLikeTheirShapes) {
  const std::string head = std::string(film) + R"(LookAt 0 -4 1  0 0 0  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [ .2 .3 .4 ]
LightSource "distant" "point3 from" [ 1 -1 2 ]
Material "coateddiffuse" "float roughness" .2
)";
  const std::string place = "Translate .2 .1 0  Rotate 30 0 1 0  Scale -1 1.2 .7\n";
  const std::string shape = R"(Shape "sphere" "float radius" .8
Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -1 -1 -.5  1 -1 -.5  0 0 1 ]
)";
  const auto direct = render_text(head + place + shape, 512, bounces(2));
  const auto instanced = render_text(
      head + "ObjectBegin \"o\"\n" + shape + "ObjectEnd\n" + place + "ObjectInstance \"o\"\n", 512, bounces(2));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(direct.mean()[c], instanced.mean()[c], .005f * direct.mean()[c]);
}

// A slab of thickness 2 that only absorbs, seen straight on, lets exp(-2 sigma_a) of the sky through.
TEST(Media, AbsorptionFollowsBeer) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 5  0 0 0  0 1 0
Camera "orthographic"
MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_a" [ .25 .25 .25 ] "rgb sigma_s" [ 0 0 0 ]
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
MediumInterface "m" ""
Material "interface"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 4 6 5 4 7 6 ]
  "point3 P" [ -9 -9 1  9 -9 1  9 9 1  -9 9 1  -9 -9 -1  9 -9 -1  9 9 -1  -9 9 -1 ]
)";
  expect_near(render_text(scene, 16, bounces(0)).mean(), std::exp(-.5f), .002f, "slab");
}

// A medium that scatters and does not absorb is invisible under a uniform sky, with or without a boundary that is not
// there.
TEST(Media, ScatteringFurnace) {
  const std::string scene = std::string(film) + R"(LookAt 0 -4 0  0 0 0  0 0 1
Camera "perspective" "float fov" 25
MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_a" [ 0 0 0 ] "rgb sigma_s" [ 2 1 .5 ] "float g" .4
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
MediumInterface "m" ""
Material "interface"
Shape "sphere" "float radius" 1
)";
  expect_near(render_text(scene, 512, bounces(0, 1000)).mean(), 1, .005f, "sphere of fog");
}

// The floor under an absorbing slab, lit by a point light above it: the shadow ray loses exp(-sigma_a thickness).
TEST(Media, ShadowRaysAreAttenuated) {
  const std::string scene = std::string(film) + R"(LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.01 .01 -.01 .01 ]
MakeNamedMedium "m" "string type" "homogeneous" "rgb sigma_a" [ 3 3 3 ] "rgb sigma_s" [ 0 0 0 ]
WorldBegin
LightSource "point" "rgb I" [ 8 8 8 ] "point3 from" [ 0 0 2 ]
AttributeBegin
MediumInterface "m" ""
Material "interface"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 4 6 5 4 7 6 ]
  "point3 P" [ -9 -9 1.2  9 -9 1.2  9 9 1.2  -9 9 1.2  -9 -9 1  9 -9 1  9 9 1  -9 9 1 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
  expect_near(render_text(scene, 16, bounces(0)).mean(), .5f * inv_pi * 2 * std::exp(-.6f), .002f, "point light");
}

}  // namespace
}  // namespace dapple
