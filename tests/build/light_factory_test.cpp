// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/light_factory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "dapple/base/hash.h"
#include "dapple/build/shape_factory.h"
#include "dapple/image/image_writer.h"
#include "dapple/image/texture_system.h"

namespace dapple::build {
namespace {

using emitters::Light;
using emitters::LightReceiver;
using emitters::LightSample;

/// Reads a scene from text and makes its only light.
class LightFactory : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() /
        ("dapple_lights_" + std::to_string(hash(uint64_t(reinterpret_cast<uintptr_t>(this)), uint64_t(::getpid()))));
    std::filesystem::create_directory(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void parse(const std::string& world) {
    description_ = scenefile::parse_pbrt("WorldBegin\n" + world + "\n", "lights.pbrt", folder_.string(), diagnostics_);
  }
  std::unique_ptr<Light> light(const std::string& directives) {
    parse(directives);
    const BuildContext context{description_, diagnostics_, textures_};
    return make_light(description_.lights.at(0), context, TextureLibrary(context));
  }
  std::vector<std::unique_ptr<Light>> area_lights(const std::string& directives,
                                                  const pattern::FloatTexturePtr& alpha = nullptr) {
    parse(directives);
    const BuildContext context{description_, diagnostics_, textures_};
    const scenefile::ShapeEntity& shape = description_.shapes.at(0);
    std::vector<std::unique_ptr<Light>> out;
    for (const trace::Shape& s : make_shapes(context, shape, shape.transform.start))
      for (auto& l : make_area_lights(description_.area_lights.at(0), make_emitters(s), alpha, nullptr, context,
                                      TextureLibrary(context), shape.loc))
        out.push_back(std::move(l));
    return out;
  }
  void write_grey(const std::string& name, int width, int height, float value) {
    image::OutputImage image;
    image.width = width;
    image.height = height;
    const size_t count = size_t(width) * size_t(height) * 3;
    image.layers.push_back(
        {.name = "", .channels = {"R", "G", "B"}, .pixels = std::vector<float>(count, value), .type = std::nullopt});
    image::write_exr((folder_ / name).string(), image);
  }

  static LightSample sampled(const Light& light, const V3f& p) {
    LightSample s;
    EXPECT_TRUE(light.sample({.p = p}, {0.5f, 0.5f}, &s));
    return s;
  }
  void expect_error(const std::string& directives, const std::string& text) {
    try {
      light(directives);
      ADD_FAILURE() << "accepted: " << directives;
    } catch (const InputError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.rfind("lights.pbrt:2:", 0), 0u) << what;
      EXPECT_NE(what.find(text), std::string::npos) << what;
    }
  }

  std::filesystem::path folder_;
  Diagnostics diagnostics_;
  image::TextureSystem textures_{uint64_t{1} << 20};
  scenefile::SceneDescription description_;
};

TEST_F(LightFactory, Point) {
  const auto l =
      light(R"(Translate 0 0 1 LightSource "point" "rgb I" [ 2 4 8 ] "point3 from" [ 0 0 1 ] "float scale" 3)");
  const LightSample s = sampled(*l, {0, 0, 0});
  EXPECT_EQ(s.radiance, RGB(1.5f, 3, 6));
  EXPECT_FLOAT_EQ(s.distance, 2);
  // A power replaces the intensity of colour 1; colour and scale still multiply (as pbrt-v4).
  EXPECT_NEAR(light(R"(LightSource "point" "float power" 100)")->power(1), 100, 1e-3);
  EXPECT_NEAR(light(R"(LightSource "point" "float power" 100 "rgb I" [ 2 2 2 ] "float scale" 3)")->power(1), 600, 1e-2);
  // Spectra have luminance 1 before the scale.
  EXPECT_NEAR(light(R"(LightSource "point" "blackbody I" 3000)")->power(1), 4 * pi, 1e-3);
}

TEST_F(LightFactory, Spot) {
  const auto l = light(
      R"(LightSource "spot" "point3 from" [ 0 0 4 ] "point3 to" [ 0 0 0 ] "float coneangle" 40 "float conedeltaangle" 10 "rgb I" [ 16 16 16 ])");
  EXPECT_EQ(sampled(*l, {0, 0, 0}).radiance, RGB(1));
  LightSample s;
  EXPECT_FALSE(l->sample({.p = V3f(4, 0, 0)}, {0, 0}, &s));  // 45 degrees off
  EXPECT_NEAR(light(R"(LightSource "spot" "float power" 50 "float coneangle" 70)")->power(1), 50, 1e-3);
}

TEST_F(LightFactory, Distant) {
  const auto l =
      light(R"(LightSource "distant" "point3 from" [ 0 0 5 ] "point3 to" [ 0 0 0 ] "rgb L" [ 1 2 3 ] "float scale" 2)");
  const LightSample s = sampled(*l, {7, 7, 7});
  EXPECT_EQ(s.radiance, RGB(2, 4, 6));
  EXPECT_FLOAT_EQ(s.wi.z, 1);
  EXPECT_TRUE(l->is_infinite());
  EXPECT_EQ(sampled(*light(R"(LightSource "distant" "float illuminance" 500)"), {0, 0, 0}).radiance, RGB(500));
  // The default shines along +z, and transforms turn it.
  EXPECT_FLOAT_EQ(sampled(*light(R"(LightSource "distant")"), {0, 0, 0}).wi.z, -1);
  EXPECT_NEAR(sampled(*light(R"(Rotate 90 1 0 0 LightSource "distant")"), {0, 0, 0}).wi.y, 1, 1e-6);
}

TEST_F(LightFactory, ConstantSky) {
  EXPECT_EQ(light(R"(LightSource "infinite" "rgb L" [ .4 .5 .6 ] "float scale" 2)")->environment({0, 0, 1}, 0),
            RGB(0.8f, 1, 1.2f));
  EXPECT_NEAR(light(R"(LightSource "infinite" "float illuminance" 100)")->environment({0, 0, 1}, 0).g, 100 / pi, 1e-4);
  EXPECT_EQ(light(R"(LightSource "infinite")")->environment({0, 0, 1}, 0), RGB(1));
}

TEST_F(LightFactory, ImageSky) {
  write_grey("sky.exr", 16, 16, 0.5f);
  write_grey("panorama.exr", 32, 16, 0.5f);
  for (const std::string file : {"sky.exr", "panorama.exr"}) {
    const auto l = light("LightSource \"infinite\" \"string filename\" \"" + file + "\" \"float scale\" 4");
    EXPECT_NEAR(l->environment(normalize(V3f(1, 2, 3)), 0).g, 2, 1e-4);
    const auto lit = light("LightSource \"infinite\" \"string filename\" \"" + file + "\" \"float illuminance\" 10");
    EXPECT_NEAR(lit->environment({0, 0, 1}, 0).g, 10 / pi, 0.02);
  }
}

TEST_F(LightFactory, ProjectionAndGoniometric) {
  write_grey("white.exr", 16, 16, 1);
  const auto p = light(R"(LightSource "projection" "string filename" "white.exr" "float fov" 60 "float scale" 8)");
  EXPECT_NEAR(sampled(*p, {0, 0, 2}).radiance.g, 2, 1e-5);
  EXPECT_NEAR(light(R"(LightSource "projection" "string filename" "white.exr" "float power" 30)")->power(1), 30, 1e-3);
  const auto g = light(R"(LightSource "goniometric" "string filename" "white.exr" "rgb I" [ 1 2 3 ])");
  EXPECT_NEAR(sampled(*g, {0, 0, 1}).radiance.b, 3, 1e-5);
  EXPECT_NEAR(light(R"(LightSource "goniometric" "string filename" "white.exr" "float power" 30)")->power(1), 30, 1e-3);
}

const char* const checks =
    R"(Texture "checks" "spectrum" "checkerboard" "float uscale" 2 "float vscale" 2 "rgb tex1" [ 4 4 4 ] "rgb tex2" [ 0 0 0 ]
)";

TEST_F(LightFactory, TexturesShineFromAreasAndOverDirections) {
  const std::string c = checks;
  const auto area = area_lights(
      c +
      R"(AreaLightSource "diffuse" "texture L" "checks" "float scale" 2 Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  0 1 0  1 1 0 ])");
  ASSERT_EQ(area.size(), 1u);
  EXPECT_EQ(area[0]->emitted({0.25f, 0.25f, 0}, {0, 0, 1}, {0.25f, 0.25f}, {0, 0, 1}), RGB(8));
  EXPECT_EQ(area[0]->emitted({0.75f, 0.25f, 0}, {0, 0, 1}, {0.75f, 0.25f}, {0, 0, 1}), RGB(0));
  EXPECT_NEAR(area[0]->power(1), 4 * pi, 1e-3);
  // The spot's picture: its axis is at u = v = 1/2, and its cone touches the edges.
  const auto spot =
      light(c + R"(LightSource "spot" "texture I" "checks" "float coneangle" 45 "float conedeltaangle" 0)");
  EXPECT_FLOAT_EQ(sampled(*spot, {0.5f, 0.5f, 1}).radiance.g, 4 / 1.5f);
  LightSample s;
  EXPECT_FALSE(spot->sample({.p = V3f(-0.5f, 0.5f, 1)}, {0, 0}, &s));
  const auto point = light(c + R"(LightSource "point" "texture I" "checks" "float scale" 2 "float falloff" 0)");
  EXPECT_NEAR(sampled(*point, V3f(3, 3, -3)).radiance.g, 8, 1e-5);  // u 1/8, v below 1/2, at any distance
  const auto slide = light(c + R"(LightSource "projection" "texture I" "checks" "float fov" 90)");
  EXPECT_FLOAT_EQ(sampled(*slide, {-0.5f, -0.5f, 1}).radiance.g, 4 / 1.5f);
  EXPECT_TRUE(diagnostics_.messages().empty()) << diagnostics_.messages().front();
}

TEST_F(LightFactory, Decay) {
  EXPECT_FLOAT_EQ(
      sampled(*light(R"(LightSource "point" "float falloff" 1 "float falloffdistance" 2)"), {4, 0, 0}).radiance.g,
      0.125f);
  EXPECT_FLOAT_EQ(
      sampled(*light(R"(LightSource "spot" "float decaydistances" [ 1 3 ] "float decay" [ 1 0 ])"), {0, 0, 2})
          .radiance.g,
      0.125f);
  expect_error(R"(LightSource "point" "float falloff" -1)", "expected an exponent");
  expect_error(R"(LightSource "point" "float falloffdistance" 0)", "above 0");
  expect_error(R"(LightSource "point" "float decaydistances" [ 1 3 ] "float decay" [ 1 ])", "expected as many");
  expect_error(R"(LightSource "point" "float decaydistances" [ 3 3 ] "float decay" [ 1 1 ])", "must increase");
  expect_error(R"(LightSource "point" "float decaydistances" [ 1 3 ] "float decay" [ 1 -1 ])", "negative");
  expect_error(R"(LightSource "spot" "texture I" "absent")", "\"absent\" is not defined");
}

// Sun and sky: power on a disk across the zenith's direction; what is looked up is the sky's radiance, and below the
// mask the mask's share of it.
TEST_F(LightFactory, SkyAndCanopy) {
  write_grey("half.exr", 2, 2, 0.5f);
  const auto sky = light(R"(LightSource "sky" "float skyirradiance" 6.2831853 "string skymodel" "uniform")");
  EXPECT_TRUE(sky->is_infinite());
  EXPECT_NEAR(sky->environment_at({0, 0, 0}, {0, 0, 1}, 0).g, 2, 1e-4);
  EXPECT_TRUE(sky->environment_at({0, 0, 0}, {0, 0, -1}, 0).is_black());
  EXPECT_NEAR(sky->power(1), pi * 2 * 2 * pi, 1e-2);
  const auto canopy = light(
      R"(LightSource "canopy" "string mask" "half.exr" "float maskwidth" 4 "float height" 3 "rgb skyirradiance" [ 3.1415927 0 0 ] "bool periodic" true)");
  EXPECT_NEAR(canopy->environment_at({0, 0, 0}, {0, 0, 1}, 0).r, 0.5f, 1e-4);
  EXPECT_NEAR(canopy->environment_at({0, 0, 4}, {0, 0, 1}, 0).r, 1, 1e-4);
  const auto sun = light(R"(LightSource "sky" "float sunirradiance" 10 "float sunzenith" 30)");
  EXPECT_GT(sampled(*sun, {0, 0, 0}).radiance.g, 10 / (pi * sqr(radians(0.2665f))));
  EXPECT_TRUE(diagnostics_.messages().empty()) << diagnostics_.messages().front();

  const std::string half = R"(LightSource "canopy" "string mask" "half.exr" "float skyirradiance" 1 )";
  expect_error(R"(LightSource "canopy" "float skyirradiance" 1)", "needs a mask");
  expect_error(half, "\"maskwidth\" is -1, expected the width");
  expect_error(half + R"("float maskwidth" 1 "float height" 0)",
               "\"height\" is 0, expected the height of the mask above the ground");
  expect_error(half + R"("float maskwidth" 1 "float height" 1 "float sunzenith" 90)", "\"sunzenith\" is 90");
  expect_error("Scale 1 1 2 " + half + R"("float maskwidth" 1 "float height" 1)", "scale all axes alike");
  expect_error(R"(LightSource "sky" "float sunirradiance" -1)", "from 0 upwards");
  expect_error(R"(LightSource "sky" "float skyirradiance" 1 "string skymodel" "preetham" "float turbidity" 1)",
               "1.9 to 10");
  write_grey("two.exr", 2, 2, 2);
  expect_error(
      R"(LightSource "canopy" "string mask" "two.exr" "float skyirradiance" 1 "float maskwidth" 1 "float height" 1)",
      "from 0 to 1");
}

TEST_F(LightFactory, BadInputIsAnErrorWithItsPlace) {
  expect_error(R"(LightSource "lamp")", "expected one of: point, spot, goniometric, projection, distant, infinite");
  expect_error(R"(LightSource "point" "rgb I" [ -1 0 0 ])", "");
  expect_error(R"(LightSource "point" "rgb I" [ 1e38 0 0 ] "float scale" 1e10)", "overflows");
  expect_error(R"(LightSource "point" "float scale" -2)", "negative");
  expect_error(R"(LightSource "point" "float power" -2)", "negative");
  expect_error(R"(LightSource "spot" "point3 from" [ 1 1 1 ] "point3 to" [ 1 1 1 ])", "direction");
  expect_error(R"(LightSource "spot" "float coneangle" 200)", "coneangle");
  expect_error(R"(LightSource "projection")", "filename");
  expect_error(R"(LightSource "infinite" "string filename" "missing.exr")", "missing.exr");
  expect_error(R"(LightSource "infinite" "string filename" "a.exr" "rgb L" [ 1 1 1 ])", "both");
  expect_error(R"(Scale 0 1 1 LightSource "infinite")", "inverse");
}

TEST_F(LightFactory, BlackLightsAreNone) {
  EXPECT_EQ(light(R"(LightSource "point" "rgb I" [ 0 0 0 ])"), nullptr);
}

TEST_F(LightFactory, UnusedParametersAndStandInsAreNamed) {
  light(R"(LightSource "point" "float brightness" 3)");
  ASSERT_EQ(diagnostics_.count(), 1u);
  EXPECT_NE(diagnostics_.messages()[0].find("brightness"), std::string::npos);
}

TEST_F(LightFactory, PortalsTurnWithTheLight) {
  const auto window = light(
      R"(Rotate 90 0 1 0 LightSource "infinite" "rgb L" [ 3 3 3 ] "point3 portal" [ -1 -1 2  -1 1 2  1 1.0005 2  1 -1 2 ])");
  EXPECT_EQ(window->environment_at(V3f(0, 0, 0), V3f(1, 0, 0), 0).g, 3);
  EXPECT_EQ(window->environment_at(V3f(0, 0, 0), V3f(0, 0, 1), 0).g, 0);
  const auto sky =
      light(R"(LightSource "sky" "float skyirradiance" 1 "point3 portal" [ -1 -1 2  -1 1 2  1 1 2  1 -1 2 ])");
  EXPECT_GT(sky->environment_at(V3f(0, 0, 0), V3f(0, 0, 1), 0).g, 0);
  EXPECT_EQ(sky->environment_at(V3f(0, 0, 0), normalize(V3f(1, 0, 1)), 0).g, 0);
  expect_error(R"(LightSource "infinite" "point3 portal" [ 0 0 0  1 0 0  1 1 0 ])", "3 points");
  expect_error(R"(LightSource "infinite" "point3 portal" [ 0 0 0  1 0 0  1 1 0  .5 1 0 ])", "rectangle");
  expect_error(R"(LightSource "infinite" "point3 portal" [ 0 0 0  0 0 0  1 1 0  1 1 0 ])", "rectangle");
}

constexpr char quad_light[] =
    R"(Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ 0 0 0  2 0 0  2 2 0  0 2 0 ])";

TEST_F(LightFactory, AreaLight) {
  const auto lights =
      area_lights(std::string(R"(AreaLightSource "diffuse" "rgb L" [ 1 2 3 ] "float scale" 2 )") + quad_light);
  ASSERT_EQ(lights.size(), 2u);
  for (const auto& l : lights) {
    EXPECT_EQ(l->emitted({1, 1, 0}, {0, 0, 1}, {0, 0}, {0, 0, 1}), RGB(2, 4, 6));
    EXPECT_EQ(sampled(*l, {1, 1, 1}).radiance, RGB(2, 4, 6));
    LightSample s;
    EXPECT_FALSE(l->sample({.p = V3f(1, 1, -1)}, {0.5f, 0.5f}, &s));
  }
}

TEST_F(LightFactory, AreaLightPowerIsThatOfEachPrimitive) {
  // As in pbrt-v4: pi A L = power, over both sides where two-sided.
  for (const char* twosided : {"false", "true"}) {
    const auto lights = area_lights(std::string(R"(AreaLightSource "diffuse" "float power" 10 "bool twosided" )") +
                                    twosided + " " + quad_light);
    for (const auto& l : lights) EXPECT_NEAR(l->power(1), 10, 1e-4);
  }
}

TEST_F(LightFactory, AreaLightImage) {
  write_grey("panel.exr", 4, 4, 0.25f);
  const auto lights = area_lights(
      std::string(R"(AreaLightSource "diffuse" "string filename" "panel.exr" "float scale" 8 )") + quad_light);
  EXPECT_NEAR(lights[0]->emitted({1, 1, 0}, {0, 0, 1}, {0.3f, 0.3f}, {0, 0, 1}).g, 2, 1e-4);
  const auto lit = area_lights(
      std::string(R"(AreaLightSource "diffuse" "string filename" "panel.exr" "float power" 8 )") + quad_light);
  EXPECT_NEAR(lit[0]->power(1), 8, 1e-4);
}

TEST_F(LightFactory, AlphaOfZeroMakesAnInvisibleLight) {
  const auto lights = area_lights(std::string(R"(AreaLightSource "diffuse" )") + quad_light,
                                  std::make_shared<pattern::ConstantTexture<float>>(0.0f));
  EXPECT_TRUE(lights[0]->is_delta());
}

TEST_F(LightFactory, PrimitivesWithoutAreaAreDroppedWithAWarning) {
  const auto lights = area_lights(
      R"(AreaLightSource "diffuse" Shape "trianglemesh" "integer indices" [ 0 1 2 0 1 1 ] "point3 P" [ 0 0 0  2 0 0  2 2 0 ])");
  ASSERT_EQ(lights.size(), 2u);
  EXPECT_NE(lights[0], nullptr);
  EXPECT_EQ(lights[1], nullptr);
  ASSERT_EQ(diagnostics_.count(), 1u);
  EXPECT_NE(diagnostics_.messages()[0].find("1 of 2"), std::string::npos);
}

/// Emitters shine to the side that hits call outside, for every shape, orientation and handedness; and they lie on the
/// traced surface.
TEST_F(LightFactory, EmittersAgreeWithTheSurfaceRaysHit) {
  const char* const shapes[] = {
      R"(Shape "sphere" "float radius" 2)",
      R"(Shape "sphere" "float zmin" -.5 "float phimax" 200)",
      R"(Shape "disk" "float height" .5 "float innerradius" .3)",
      R"(Shape "cylinder" "float phimax" 300)",
      R"(Shape "bilinearmesh" "integer indices" [ 0 1 2 3 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ])",
      R"(Shape "bilinearmesh" "integer indices" [ 0 1 2 3 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 2 1 0 ])",
      R"(Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 ])",
      R"(Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "normal N" [ 0 0 -1 0 0 -1 0 0 -1 ])"};
  for (const char* shape : shapes)
    for (const char* orientation : {"", "ReverseOrientation "})
      for (const char* transform : {"", "Scale -1 1 1 ", "Rotate 40 1 2 3 Scale 1 2 -1.5 "}) {
        parse(std::string(orientation) + transform + shape);
        const BuildContext context{description_, diagnostics_, textures_};
        const scenefile::ShapeEntity& e = description_.shapes.at(0);
        for (const trace::Shape& s : make_shapes(context, e, e.transform.start)) {
          const auto emitters = make_emitters(s);
          ASSERT_FALSE(emitters.empty());
          for (uint32_t i = 0; i < 20; ++i) {
            KeyedRng rng(hash(i));
            geom::EmitterSample sample;
            const V2f u(rng.next(), rng.next());
            if (!geom::sample(*emitters[0], V3f(4, 5, 6), u, &sample)) continue;
            geom::SurfacePoint hit;
            if (const auto* quadric = std::get_if<trace::QuadricPtr>(&s)) {
              hit = (*quadric)->at(sample.uv.x, sample.uv.y);
            } else {
              const geom::Mesh& mesh = *std::get<trace::MeshPtr>(s);
              // Without uv a triangle's are (0, 0), (1, 0), (1, 1): barycentric b1 = u - v, b2 = v.
              const bool triangle = mesh.corners == 3;
              hit = mesh.at(0, triangle ? sample.uv.x - sample.uv.y : sample.uv.x, sample.uv.y, 0);
            }
            EXPECT_LT(length(hit.P - sample.p), 1e-3f) << orientation << transform << shape;
            EXPECT_GT(dot(hit.Ng, sample.n), 0.999f) << orientation << transform << shape;
            EXPECT_NEAR(hit.u, sample.uv.x, 1e-4f);
          }
        }
      }
}

}  // namespace
}  // namespace dapple::build
