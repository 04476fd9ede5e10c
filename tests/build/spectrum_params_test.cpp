// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/spectrum_params.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "dapple/image/texture_system.h"
#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/named_spectra.h"

namespace dapple::build {
namespace {

using scenefile::ColorSpace;
using scenefile::Param;
using scenefile::ParamType;

class SpectrumParams : public testing::Test {
 protected:
  Param param(ParamType type, std::vector<float> numbers, std::vector<std::string> strings = {}) {
    Param p;
    p.type = type;
    p.name = "L";
    p.loc = {"scene.pbrt", 12, 5};
    p.numbers = std::move(numbers);
    p.strings = std::move(strings);
    return p;
  }
  Param rgb(float r, float g, float b) { return param(ParamType::rgb, {r, g, b}); }
  Param spectrum(std::vector<float> numbers) { return param(ParamType::spectrum, std::move(numbers)); }
  Param named(const std::string& name) { return param(ParamType::spectrum, {}, {name}); }

  template <class F>
  void expect_error(F&& f, const std::string& text) {
    try {
      f();
      ADD_FAILURE() << "accepted; expected an error about: " << text;
    } catch (const InputError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.rfind("scene.pbrt:12:5", 0), 0u) << what;
      EXPECT_NE(what.find(text), std::string::npos) << what;
    }
  }
  static void expect_near(RGB a, RGB b, float tolerance) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
  }

  scenefile::SceneDescription description_;
  Diagnostics diagnostics_;
  image::TextureSystem textures_{uint64_t{1} << 20};
  BuildContext context_{description_, diagnostics_, textures_};
};

TEST_F(SpectrumParams, RgbIsTakenAsItIs) {
  EXPECT_EQ(illuminant_rgb(rgb(7, 0.25f, 1), context_), RGB(7, 0.25f, 1));
  EXPECT_EQ(reflectance_rgb(rgb(0.7f, 0.25f, 1), context_), RGB(0.7f, 0.25f, 1));
  EXPECT_EQ(unbounded_rgb(rgb(3, 0.25f, 0), context_), RGB(3, 0.25f, 0));
  EXPECT_EQ(unbounded_rgb(param(ParamType::real, {1.5f}), context_), RGB(1.5f));
  EXPECT_EQ(diagnostics_.count(), 0u);
}

TEST_F(SpectrumParams, ColourSpaceOfTheParameter) {
  for (const ColorSpace space : {ColorSpace::dci_p3, ColorSpace::rec2020, ColorSpace::aces2065_1}) {
    Param white = rgb(1, 1, 1), mixed = rgb(0.4f, 0.5f, 0.3f);
    white.color_space = mixed.color_space = space;
    expect_near(reflectance_rgb(white, context_), RGB(1), 1e-5f);
    const RGB c = reflectance_rgb(mixed, context_);
    EXPECT_GT(c.g, 0.5f);  // wider primaries: more saturated in Rec.709
    EXPECT_LT(c.b, 0.31f);
    EXPECT_NEAR(illuminant_rgb(white, context_).luminance(), 1, 1e-3f);
  }
  Param p = rgb(0, 1, 0);
  p.color_space = ColorSpace::rec2020;
  EXPECT_EQ(diagnostics_.count(), 0u);
  EXPECT_EQ(illuminant_rgb(p, context_).min(), 0);  // outside Rec.709, not negative
  ASSERT_EQ(diagnostics_.messages().size(), 1u);
  EXPECT_NE(diagnostics_.messages()[0].find("outside Rec.709"), std::string::npos);
}

TEST_F(SpectrumParams, LightsHaveLuminanceOne) {
  for (const float t : {1000.0f, 2800.0f, 6500.0f, 12000.0f})
    EXPECT_NEAR(illuminant_rgb(param(ParamType::blackbody, {t}), context_).luminance(), 1, 2e-4f);
  EXPECT_GT(illuminant_rgb(param(ParamType::blackbody, {2800}), context_).r, 1.5f);
  // The scale of a light's spectrum does not matter.
  expect_near(illuminant_rgb(spectrum({400, 1, 700, 3}), context_),
              illuminant_rgb(spectrum({400, 100, 700, 300}), context_), 1e-5f);
  expect_near(illuminant_rgb(named("stdillum-D65"), context_), RGB(1), 1e-3f);
}

TEST_F(SpectrumParams, ReflectanceAboveOneIsClampedWithOneWarning) {
  EXPECT_EQ(reflectance_rgb(rgb(1.5f, 0.5f, 0), context_), RGB(1, 0.5f, 0));
  EXPECT_EQ(reflectance_rgb(rgb(1.5f, 0.5f, 0), context_), RGB(1, 0.5f, 0));
  ASSERT_EQ(diagnostics_.messages().size(), 1u);
  EXPECT_NE(diagnostics_.messages()[0].find("scene.pbrt:12:5"), std::string::npos);
  expect_near(reflectance_rgb(spectrum({360, 0.3f, 830, 0.3f}), context_), RGB(0.3f), 1e-5f);
}

TEST_F(SpectrumParams, BadValuesAreLocated) {
  const float nan = std::nanf(""), inf = infinity;
  expect_error([&] { illuminant_rgb(param(ParamType::rgb, {1, 2}), context_); }, "three numbers");
  expect_error([&] { illuminant_rgb(rgb(1, nan, 1), context_); }, "not finite");
  expect_error([&] { illuminant_rgb(rgb(1, -1, 1), context_); }, "negative");
  expect_error([&] { reflectance_rgb(rgb(-0.1f, 0, 1), context_); }, "negative");
  expect_error([&] { unbounded_rgb(rgb(inf, 0, 1), context_); }, "not finite");
  expect_error([&] { unbounded_rgb(param(ParamType::real, {1, 2}), context_); }, "one number");
  for (const float t : {0.0f, -100.0f, nan, inf})
    expect_error([&] { illuminant_rgb(param(ParamType::blackbody, {t}), context_); }, "above 0");
  expect_error([&] { illuminant_rgb(param(ParamType::blackbody, {3000, 1}), context_); }, "one temperature");
  expect_error([&] { illuminant_rgb(spectrum({400, 1, 500}), context_); }, "pairs");
  expect_error([&] { illuminant_rgb(spectrum({}), context_); }, "pairs");
  expect_error([&] { reflectance_rgb(spectrum({500, 1, 400, 1}), context_); }, "increasing");
  expect_error([&] { reflectance_rgb(spectrum({400, nan}), context_); }, "finite");
  expect_error([&] { unbounded_rgb(spectrum({400, -1, 500, 1}), context_); }, "negative");
}

TEST_F(SpectrumParams, IllegalTypesSayWhatIsLegal) {
  expect_error([&] { reflectance_rgb(param(ParamType::blackbody, {3000}), context_); }, "rgb, spectrum");
  expect_error([&] { illuminant_rgb(param(ParamType::real, {1}), context_); }, "rgb, blackbody, spectrum");
  expect_error([&] { unbounded_rgb(param(ParamType::texture, {}, {"t"}), context_); }, "rgb, spectrum, float");
}

TEST_F(SpectrumParams, UnknownNamesListTheLegalOnes) {
  expect_error([&] { unbounded_rgb(named("metal-Xx-eta"), context_); }, "metal-Au-eta");
  expect_error([&] { unbounded_rgb(named(""), context_); }, "glass-BK7");
}

TEST_F(SpectrumParams, FilesAreRelativeToTheScene) {
  const auto folder = std::filesystem::temp_directory_path() / "dapple_spectrum_params_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "half.spd") << "360 0.5\n830 0.5\n";
  std::ofstream(folder / "bad.spd") << "360 0.5\n830\n";
  description_.base_directory = folder.string();
  expect_near(reflectance_rgb(named("half.spd"), context_), RGB(0.5f), 1e-5f);
  try {
    reflectance_rgb(named("bad.spd"), context_);
    ADD_FAILURE();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("bad.spd:2:1"), std::string::npos) << e.what();
  }
  std::filesystem::remove_all(folder);
}

TEST_F(SpectrumParams, Conductors) {
  scenefile::ParamSet none, gold, reflectance, mixed;
  const ConductorRgb copper = conductor_of(none, "", context_);
  EXPECT_NEAR(fresnel_conductor(1.0f, copper.eta.g, copper.k.g), 0.62f, 0.02f);
  const auto add = [&](scenefile::ParamSet* set, Param p, const char* name) {
    p.name = name;
    set->add(p);
  };
  add(&gold, named("metal-Au-eta"), "conductor.eta");
  add(&gold, named("metal-Au-k"), "conductor.k");
  const ConductorRgb au = conductor_of(gold, "conductor.", context_);
  EXPECT_NEAR(fresnel_conductor(1.0f, au.eta.b, au.k.b), 0.36f, 0.02f);
  EXPECT_EQ(conductor_of(gold, "", context_).eta, copper.eta);  // not its prefix
  add(&reflectance, rgb(0.2f, 0.4f, 0.8f), "reflectance");
  EXPECT_EQ(conductor_of(reflectance, "", context_).eta, RGB(1));
  add(&mixed, rgb(0.2f, 0.4f, 0.8f), "eta");
  add(&mixed, rgb(3, 2, 1), "k");
  EXPECT_EQ(conductor_of(mixed, "", context_).k, RGB(3, 2, 1));
  EXPECT_EQ(conductor_of(mixed, "", context_, 2).k, RGB(1.5f, 1, 0.5f));
  add(&mixed, rgb(0.2f, 0.4f, 0.8f), "reflectance");
  expect_error([&] { conductor_of(mixed, "", context_); }, "not both");
}

}  // namespace
}  // namespace dapple::build
