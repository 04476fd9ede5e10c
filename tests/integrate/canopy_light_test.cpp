// SPDX-License-Identifier: Apache-2.0
// Light "canopy" and rays through a real sheet, against the irradiance of forest/penumbra.h.
#include "dapple/forest/canopy_light.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/forest/penumbra.h"
#include "dapple/image/image_writer.h"
#include "tests/support/process.h"
#include "tests/support/render_text.h"

namespace dapple::forest {
namespace {

constexpr int n = 32, fine = 4;  // pixels of mask and picture; irradiances of the reference across each
constexpr double width = 3.2, height = 2, degree = std::numbers::pi / 180;

/// Leaves of 2 x 2 pixels.
float leaf(int x, int y) {
  return to_unit_float(hash(uint64_t(x / 2), uint64_t(y / 2))) < 0.55f ? 0.0f : 1.0f;
}

void write_mask(const std::string& path, int scale) {
  image::OutputImage out;
  out.width = out.height = n * scale;
  image::ImageLayer layer{"", {"Y"}, {}, image::SampleType::full_float};
  for (int y = 0; y < n * scale; ++y)
    for (int x = 0; x < n * scale; ++x) layer.pixels.push_back(leaf(x / scale, y / scale));
  out.layers.push_back(layer);
  image::write_exr(path, out);
}

struct Case {
  const char* name;
  const char* params;
  bool sun, sky, periodic;
};

constexpr double sun_zenith = 35, sun_azimuth = 70;

std::vector<double> expected(const Case& c) {
  CanopyMask mask{Raster(n * fine, n * fine, 1), width / (n * fine), c.periodic};
  for (int y = 0; y < n * fine; ++y)
    for (int x = 0; x < n * fine; ++x) mask.transmittance.row(0, y)[x] = leaf(x / fine, y / fine);
  const CanopyPlane plane{mask, height};
  std::optional<SunDisc> sun;
  std::optional<SkyDome> sky;
  if (c.sun) sun.emplace(sun_zenith * degree, sun_azimuth * degree, RGB(600));
  if (c.sky) sky = SkyDome::cie_clear(sky_direction(sun_zenith * degree, sun_azimuth * degree)).with_irradiance(150);
  const Raster e = ground_irradiance(std::span(&plane, 1), sun, sky);
  std::vector<double> out;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      double sum = 0;
      for (int j = 0; j < fine; ++j)
        for (int i = 0; i < fine; ++i) sum += double(e.at(1, x * fine + i, y * fine + j));
      out.push_back(sum / (fine * fine));
    }
  return out;
}

/// The ground seen from above, from under the sheet: +x to the right. A floor of reflectance .5 shows E / (2 pi).
std::string scene_text(const std::string& world) {
  return R"(Scale -1 1 1 LookAt 0 0 1  0 0 0  0 1 0 Camera "orthographic" "float screenwindow" [ -1.6 1.6 -1.6 1.6 ]
    Film "rgb" "integer xresolution" [ 32 ] "integer yresolution" [ 32 ] PixelFilter "box" "float xradius" [ 0.5 ] "float yradius" [ 0.5 ]
    WorldBegin Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
    Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
)" + world;
}

std::vector<double> irradiance(const scene::Film& film) {
  std::vector<double> e;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) e.push_back(2 * std::numbers::pi * double(film.pixel(x, y).g));
  return e;
}

/// Means within `mean`, averages of 8 x 8 pixels within `block`, both relative to the mean.
void expect_alike(const std::vector<double>& e, const std::vector<double>& reference, double mean, double block,
                  const std::string& what) {
  double sum = 0, reference_sum = 0;
  for (size_t i = 0; i < e.size(); ++i) sum += e[i], reference_sum += reference[i];
  EXPECT_NEAR(sum / reference_sum, 1, mean) << what;
  const double scale = reference_sum / double(n * n);
  for (int by = 0; by < n; by += 8)
    for (int bx = 0; bx < n; bx += 8) {
      double difference = 0;
      for (int y = by; y < by + 8; ++y)
        for (int x = bx; x < bx + 8; ++x) difference += e[size_t(y * n + x)] - reference[size_t(y * n + x)];
      EXPECT_NEAR(difference / 64 / scale, 0, block) << what << " block " << bx << "," << by;
    }
}

class CanopyLights : public testing::TestWithParam<Case> {
 protected:
  CanopyLights() {
    write_mask(folder_.file("mask.exr"), 1);
    write_mask(folder_.file("cut.exr"), 8);
  }
  std::string light(const std::string& type) const {
    const Case& c = GetParam();
    std::string text =
        "LightSource \"" + type + "\" \"float sunzenith\" 35 \"float sunazimuth\" 70 \"string skymodel\" \"clear\" ";
    if (c.sun) text += "\"float sunirradiance\" 600 ";
    if (c.sky) text += "\"float skyirradiance\" 150 ";
    if (type == "canopy")
      text += "\"string mask\" \"" + folder_.file("mask.exr") + "\" \"float maskwidth\" 3.2 \"float height\" 2 ";
    if (type == "canopy" && c.periodic) text += "\"bool periodic\" true ";
    return text;
  }
  test::ScratchFolder folder_;
};

// Rationale: one model in two programs. Expectation: what the light gives to level ground is what the correlation says,
// by shadow rays of both integrators: means within .5 %, blocks within 2.5 % (4096 samples of light a block of 8 x 8,
// whose spread is about the mean's: 3 standard deviations are 4.7 % / sqrt(samples / 1024)).
TEST_P(CanopyLights, GiveTheIrradianceOfThePenumbra) {
  const std::vector<double> reference = expected(GetParam());
  const build::BuiltScene built = test::build_text(scene_text(light("canopy")));
  path::PathIntegrator::Settings path = test::bounces(0);
  expect_alike(irradiance(test::render_built(built, 256, path).film), reference, 0.005, 0.025, "path");
  distribution::DistributionIntegrator::Settings distribution;
  distribution.shading.bounces = 0;
  distribution.shading.shadow_rays = integrate::RayList({64});
  distribution.shading_rate = 1.0f / 64;  // leaves are two pixels wide and their edges sharp
  expect_alike(irradiance(test::render_built(built, 4, distribution).film), reference, 0.01, 0.03, "distribution");
}

INSTANTIATE_TEST_SUITE_P(Lights, CanopyLights,
                         testing::Values(Case{"Sun", "", true, false, false}, Case{"Sky", "", false, true, false},
                                         Case{"Both", "", true, true, false}, Case{"Periodic", "", true, true, true}),
                         [](const auto& chosen) { return chosen.param.name; });

using CutSheets = CanopyLights;

// Rationale: against ray tracing of the same leaves as geometry in one plane, cut out by alpha, under the same sun and
// sky. Expectation: the mean within 1 %, blocks within 3 %.
TEST_P(CutSheets, GiveTheIrradianceOfThePenumbra) {
  const build::BuiltScene built = test::build_text(scene_text(light("sky") + R"(
    Texture "cut" "float" "imagemap" "string filename" ")" + folder_.file("cut.exr") +
                                                              R"(" "string filter" "point" "bool invert" true
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    Shape "bilinearmesh" "point3 P" [ -1.6 -1.6 2  1.6 -1.6 2  -1.6 1.6 2  1.6 1.6 2 ] "texture alpha" "cut")"));
  expect_alike(irradiance(test::render_built(built, 256, test::bounces(0)).film), expected(GetParam()), 0.01, 0.03,
               "sheet");
}

INSTANTIATE_TEST_SUITE_P(Lights, CutSheets,
                         testing::Values(Case{"Sun", "", true, false, false}, Case{"Both", "", true, true, false}),
                         [](const auto& chosen) { return chosen.param.name; });

// Rationale: rays that find the light by chance. Expectation: a mirror shows the sheet; above it the open sky; samples
// agree with environment_at and pdf.
TEST(CanopyLight, SamplesAgreeWithWhatIsSeen) {
  CanopyMask mask{Raster(n, n, 1), width / n, true};
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) mask.transmittance.row(0, y)[x] = leaf(x, y);
  const SunDisc sun(0.5, 1, RGB(100));
  const Transform t = Transform::translate({5, 6, 7}) * Transform::rotate(30, {1, 2, 3}) * Transform::scale({2, 2, 2});
  const CanopyLight light(CanopyLight::Sheet{mask, 2}, sun, SkyDome::preetham(sun.direction(), 3).with_irradiance(50),
                          t);
  int drawn = 0, agree = 0;
  for (uint32_t i = 0; i < 4000; ++i) {
    KeyedRng rng(i);
    const emitters::LightReceiver to{t.point({rng.next() * 4 - 2, rng.next() * 4 - 2, rng.next()}), V3f(0, 0, 1)};
    emitters::LightSample s;
    if (!light.sample(to, {rng.next(), rng.next()}, &s)) continue;
    ++drawn;
    EXPECT_NEAR(light.pdf(to, s.wi, {}, {}), s.pdf, 2e-2f * s.pdf);
    const RGB seen = light.environment_at(to.p, s.wi, 0);
    agree += std::abs(seen.g - s.radiance.g) <= 2e-2f * s.radiance.g;
  }
  EXPECT_GT(drawn, 1000);
  EXPECT_GT(agree, 0.99 * drawn) << "all but directions at the edge of a pixel or the sun";
  const V3f up = normalize(t.vector({0, 0, 1}));
  EXPECT_TRUE(light.environment_at(t.point({0, 0, 0}), -up, 0).is_black()) << "below the horizon";
  EXPECT_FALSE(light.environment_at(t.point({0, 0, 2.1f}), up, 0).is_black()) << "above the sheet";
  EXPECT_THROW(CanopyLight(CanopyLight::Sheet{mask, 2}, sun, std::nullopt, Transform::scale({1, 1, 2})),
               std::invalid_argument);
  EXPECT_THROW(CanopyLight(CanopyLight::Sheet{mask, 0}, sun, std::nullopt, Transform()), std::invalid_argument);
}

}  // namespace
}  // namespace dapple::forest
