// SPDX-License-Identifier: Apache-2.0
// Albedo and normals for denoisers: closed forms of what pixels show in metal and glass, and no pixel of any material
// is black.
#include <gtest/gtest.h>

#include <cstring>

#include "dapple/base/parallel.h"
#include "dapple/render/frame_denoiser.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using render::FeatureLayers;
using test::build_text;

struct Seen {
  RGB albedo;
  V3f normal;
};

FeatureLayers features_of(const scene::Scene& scene, int samples = 4) {
  return render::trace_features(scene, scene.film.crop, {samples, 0, 4});
}

build::BuildOptions sized(int width, int height) {
  build::BuildOptions options;
  options.film.resolution = V2i(width, height);
  return options;
}

Seen pixel(const FeatureLayers& layers, int x, int y) {
  const float *a = layers.albedo.pixel(x, y), *n = layers.normal.pixel(x, y);
  return {RGB(a[0], a[1], a[2]), V3f(n[0], n[1], n[2])};
}

// Looks straight down from z = 5, at nearly normal incidence: a floor of .4 at z = 0, and things above it. A ceiling of
// (.2, .5, .8) lies behind the camera.
constexpr const char* head = R"(LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 1
Film "rgb" "integer xresolution" 5 "integer yresolution" 5
PixelFilter "box"
WorldBegin
)";
constexpr const char* box = R"(Material "diffuse" "rgb reflectance" [ .4 .4 .4 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
Material "diffuse" "rgb reflectance" [ .2 .5 .8 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 6  9 -9 6  -9 9 6  9 9 6 ]
)";
constexpr const char* sheet = R"(Shape "bilinearmesh" "point3 P" [ -1 -1 1  1 -1 1  -1 1 1  1 1 1 ]
)";
const RGB ceiling(.2f, .5f, .8f);

Seen in_the_middle(const std::string& world) {
  return pixel(features_of(*build_text(head + world).scene), 2, 2);
}

void expect_seen(const Seen& seen, const RGB& albedo, float normal_z, const std::string& what) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen.albedo[c], albedo[c], 1e-3f) << what << ", channel " << c;
  EXPECT_NEAR(seen.normal.z, normal_z, 1e-3f) << what;
}

// Fresnel at normal incidence.
float metal(float eta, float k) {
  return (sqr(eta - 1) + sqr(k)) / (sqr(eta + 1) + sqr(k));
}
float glass(float ior) {
  return sqr((ior - 1) / (ior + 1));
}

TEST(Features, SurfacesShowThemselves) {
  expect_seen(in_the_middle(box), RGB(.4f), 1, "matte");
  expect_seen(
      in_the_middle(
          std::string(box) +
          "Material \"diffusetransmission\" \"rgb reflectance\" [ .3 .3 .3 ] \"rgb transmittance\" [ .2 .2 .2 ]\n" +
          sheet),
      RGB(.5f), 1, "leaf");
  const Seen rough = in_the_middle(
      std::string(box) +
      "Material \"conductor\" \"rgb eta\" [ .2 .2 .2 ] \"rgb k\" [ 3 3 3 ] \"float roughness\" .5\n" + sheet);
  EXPECT_GT(rough.albedo.g, .5f * metal(.2f, 3));  // what so rough a surface loses between its facets is below a half
  EXPECT_LT(rough.albedo.g, metal(.2f, 3));
  EXPECT_NEAR(rough.normal.z, 1, 1e-3f);
  const Seen varnish =
      in_the_middle(std::string(box) + "Material \"coateddiffuse\" \"rgb reflectance\" [ .1 .3 .6 ]\n" + sheet);
  EXPECT_GT(varnish.albedo.b, varnish.albedo.g);
  EXPECT_GT(varnish.albedo.g, varnish.albedo.r);
  EXPECT_GT(varnish.albedo.r, .05f);
}

TEST(Features, MirrorsShowWhatIsSeenInThem) {
  const float F = metal(.2f, 3);
  expect_seen(
      in_the_middle(std::string(box) + "Material \"conductor\" \"rgb eta\" [ .2 .2 .2 ] \"rgb k\" [ 3 3 3 ]\n" + sheet),
      ceiling * F, -F, "mirror");
  // A mirror that faces a mirror ends somewhere, not at black.
  const std::string metal_sheet = "Material \"conductor\" \"rgb eta\" [ .01 .01 .01 ] \"rgb k\" [ 30 30 30 ]\n";
  const Seen endless =
      in_the_middle(metal_sheet + sheet + "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 6  9 -9 6  -9 9 6  9 9 6 ]\n");
  EXPECT_GT(endless.albedo.g, .95f);
}

TEST(Features, GlassShowsBothWaysByFresnel) {
  const float R = 2 * glass(1.5f) / (1 + glass(1.5f));
  expect_seen(in_the_middle(std::string(box) + "Material \"thindielectric\" \"float eta\" 1.5\n" + sheet),
              RGB(.4f) * (1 - R) + ceiling * R, 1 - 2 * R, "pane");
  // A ball, seen along its axis, is a slab; what counts for less than .05 of a pixel goes the stronger way.
  const float heavy = 2 * glass(2) / (1 + glass(2));
  const Seen ball =
      in_the_middle(std::string(box) +
                    "Material \"dielectric\" \"float eta\" 2\nTranslate 0 0 2\nShape \"sphere\" \"float radius\" 1\n");
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(ball.albedo[c], ceiling[c] * heavy + .4f * (1 - heavy), .02f) << c;
  // .04 counts little: all goes through.
  expect_seen(in_the_middle(
                  std::string(box) +
                  "Material \"dielectric\" \"float eta\" 1.5\nTranslate 0 0 2\nShape \"sphere\" \"float radius\" 1\n"),
              RGB(.4f), 1, "ball");
}

TEST(Features, LightsAndSkiesAreNoBrighterThanWhite) {
  expect_seen(in_the_middle("LightSource \"infinite\" \"rgb L\" [ .1 .2 .3 ]\n"), RGB(.1f, .2f, .3f), 0, "dim sky");
  expect_seen(in_the_middle("LightSource \"infinite\" \"rgb L\" [ 10 20 40 ]\n"), RGB(.25f, .5f, 1), 0, "bright sky");
  expect_seen(
      in_the_middle(
          std::string(box) +
          "AreaLightSource \"diffuse\" \"rgb L\" [ 50 50 50 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n" +
          sheet),
      RGB(1), 1, "lamp");
  expect_seen(in_the_middle("LightSource \"point\"\n"), RGB(0), 0, "nothing");
  // An edge through the pixels: half of each, and of the normal.
  const Seen edge = in_the_middle(
      "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\nShape \"bilinearmesh\" \"point3 P\" [ -1 -1 1  0 -1 1  "
      "-1 1 1  0 1 1 ]\n");
  EXPECT_NEAR(edge.albedo.g, .4f, .21f);  // of 4 samples, 1 to 3 lie on either side
  EXPECT_NEAR(edge.normal.z, edge.albedo.g / .8f, 1e-3f);
}

TEST(Features, OfCropsAndAnyThreadsAreTheSame) {
  Diagnostics diagnostics;
  const auto built = build::load_scene(std::string(DAPPLE_SOURCE_DIR) + "/scenes/stage/material_dielectric.pbrt",
                                       sized(40, 30), diagnostics);
  set_thread_count(1);
  const FeatureLayers one = features_of(*built.scene);
  set_thread_count(3);
  const Box2i part(V2i(7, 5), V2i(33, 21));
  const FeatureLayers crop = render::trace_features(*built.scene, part, {4, 0, 4});
  set_thread_count(0);
  for (int y = part.min.y; y < part.max.y; ++y)
    for (int x = part.min.x; x < part.max.x; ++x) {
      EXPECT_EQ(std::memcmp(one.albedo.pixel(x, y), crop.albedo.pixel(x - part.min.x, y - part.min.y), 12), 0)
          << x << " " << y;
      EXPECT_EQ(std::memcmp(one.normal.pixel(x, y), crop.normal.pixel(x - part.min.x, y - part.min.y), 12), 0)
          << x << " " << y;
    }
}

// Floor and wall of the stage are .5 and more, its ball .05 and more in all materials: 0 is what glass and metal had
// once.
TEST(Features, NoMaterialOfTheStageIsBlack) {
  for (const char* name :
       {"coatedconductor", "coateddiffuse", "conductor_brushed", "conductor_copper", "conductor_mirror", "dielectric",
        "dielectric_rough", "diffuse", "diffusetransmission", "mix", "thindielectric"}) {
    Diagnostics diagnostics;
    const auto built = build::load_scene(std::string(DAPPLE_SOURCE_DIR) + "/scenes/stage/material_" + name + ".pbrt",
                                         sized(48, 48), diagnostics);
    const FeatureLayers layers = features_of(*built.scene);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 48; ++x) {
        const RGB a = pixel(layers, x, y).albedo;
        ASSERT_GT(a.max(), .05f) << name << " " << x << " " << y;
        ASSERT_LE(a.max(), 1) << name << " " << x << " " << y;
      }
  }
}

}  // namespace
}  // namespace dapple
