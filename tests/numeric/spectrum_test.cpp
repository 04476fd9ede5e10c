// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/spectrum.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include "dapple/base/hash.h"
#include "dapple/numeric/named_spectra.h"
#include "dapple/numeric/rgb_primaries.h"

namespace dapple {
namespace {

void expect_near(RGB a, RGB b, float tolerance, const std::string& what = {}) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << what << " channel " << i;
}

SampledSpectrum named(std::string_view name) {
  auto s = find_named_spectrum(name);
  if (!s) throw std::runtime_error("no spectrum " + std::string(name));
  return *s;
}

// CIE 018:2019 and the published 1 nm tables.
TEST(Observer, SumsAndKnownValues) {
  XYZ sum;
  for (int nm = 360; nm <= 830; ++nm) {
    const XYZ c = colour_matching(nm);
    sum = {sum.x + c.x, sum.y + c.y, sum.z + c.z};
  }
  EXPECT_NEAR(sum.x, 106.865, 2e-3);
  EXPECT_NEAR(sum.y, cie_y_integral, 1e-3);
  EXPECT_NEAR(sum.z, 106.892, 2e-3);
  EXPECT_NEAR(colour_matching(555).y, 1, 1e-12);
  EXPECT_NEAR(colour_matching(441).x, 0.3495999, 5e-5);
  EXPECT_NEAR(colour_matching(442).z, 1.7696233, 3e-4);
  EXPECT_NEAR(colour_matching(551).y, 0.9967108, 5e-5);
  EXPECT_NEAR(colour_matching(612).x, 0.9793314, 2e-4);
  EXPECT_EQ(colour_matching(359).y, 0);
  EXPECT_EQ(colour_matching(831).y, 0);
}

// Chromaticities of CIE 015:2004, tables T.3, T.8.1 and T.8.2: a check of every illuminant's table.
TEST(Illuminants, HaveTheirPublishedChromaticities) {
  struct {
    const char* name;
    double x, y;
  } const published[] = {
      {"stdillum-A", 0.44758, 0.40745},    {"stdillum-D50", 0.34567, 0.35851}, {"stdillum-D65", 0.31272, 0.32903},
      {"illum-acesD60", 0.32168, 0.33767}, {"stdillum-F1", 0.3131, 0.3371},    {"stdillum-F2", 0.3721, 0.3751},
      {"stdillum-F3", 0.4091, 0.3941},     {"stdillum-F4", 0.4402, 0.4031},    {"stdillum-F5", 0.3138, 0.3452},
      {"stdillum-F6", 0.3779, 0.3882},     {"stdillum-F7", 0.3129, 0.3292},    {"stdillum-F8", 0.3458, 0.3586},
      {"stdillum-F9", 0.3741, 0.3727},     {"stdillum-F10", 0.3458, 0.3588},   {"stdillum-F11", 0.3805, 0.3769},
      {"stdillum-F12", 0.4370, 0.4042}};
  for (const auto& p : published) {
    const XYZ c = integrate_xyz(named(p.name));
    const double sum = c.x + c.y + c.z;
    EXPECT_NEAR(c.x / sum, p.x, 4e-4) << p.name;
    EXPECT_NEAR(c.y / sum, p.y, 4e-4) << p.name;
  }
}

// The published D65 table (CIE 015:2004, T.1).
TEST(Illuminants, DaylightReproducesThePublishedD65) {
  const SampledSpectrum d65 = named("stdillum-D65");
  const std::pair<double, double> table[] = {{300, 0.0341},  {400, 82.7549}, {405, 87.1204}, {450, 117.008},
                                             {500, 109.354}, {560, 100},     {600, 90.0062}, {650, 80.0268},
                                             {700, 71.6091}, {830, 60.3125}};
  for (const auto& [nm, value] : table) EXPECT_NEAR(d65(nm), value, 1e-3) << nm;
  EXPECT_NEAR(named("stdillum-A")(780), 241.675, 1e-2);
  EXPECT_NEAR(named("illum-acesD60")(400), 72.1085, 0.1);  // published without the rounding of CIE 15
}

TEST(Rgb, MatrixIsTheInverseOfThePrimaries) {
  const RgbMatrix m = rgb_to_xyz(rec709_primaries);
  for (const RGB c : {RGB(1, 0, 0), RGB(0, 1, 0), RGB(0, 0, 1), RGB(1), RGB(0.2f, 0.5f, 3)}) {
    const RGB xyz = m(c);
    expect_near(xyz_to_rgb({xyz.r, xyz.g, xyz.b}), c, 2e-6f);
    EXPECT_NEAR(xyz.g, c.luminance(), 2e-4f);
  }
}

TEST(Rgb, OtherColourSpaces) {
  for (const RgbPrimaries& p : {rec709_primaries, rec2020_primaries, dci_p3_primaries}) {
    expect_near(rgb_to_rec709(p, White::keep)(RGB(1)), RGB(1), 1e-6f);
    expect_near(rgb_to_rec709(p, White::adapt)(RGB(1)), RGB(1), 1e-6f);
  }
  expect_near(rgb_to_rec709(aces2065_1_primaries, White::adapt)(RGB(1)), RGB(1), 1e-6f);
  // The D60 white itself is warmer than D65; luminance is kept.
  const RGB d60 = rgb_to_rec709(aces2065_1_primaries, White::keep)(RGB(1));
  expect_near(d60, emission_to_rgb(named("illum-acesD60")), 2e-3f);
  EXPECT_GT(d60.r, 1.02f);
  // ITU-R BT.2087: the inverse of its matrix from BT.709 to BT.2020, first column.
  expect_near(rgb_to_rec709(rec2020_primaries, White::keep)(RGB(1, 0, 0)), RGB(1.6605f, -0.1246f, -0.0182f), 1e-4f);
}

TEST(SampledSpectrum, InterpolatesAndHoldsItsEnds) {
  const SampledSpectrum s({400, 500, 700}, {1, 3, -1});
  EXPECT_EQ(s(400), 1);
  EXPECT_EQ(s(450), 2);
  EXPECT_EQ(s(600), 1);
  EXPECT_EQ(s(100), 1);
  EXPECT_EQ(s(900), -1);
  EXPECT_EQ(s.min(), -1);
  EXPECT_EQ(s.max(), 3);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(SampledSpectrum({}, {}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({400}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({400, 400}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({500, 400}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({-1, 400}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({nan, 400}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(SampledSpectrum({300, 400}, {1, nan}), std::invalid_argument);
}

TEST(Emission, HasLuminanceOne) {
  for (const std::string_view name : {"stdillum-A", "stdillum-D50", "stdillum-F2", "stdillum-F11"})
    EXPECT_NEAR(emission_to_rgb(named(name)).luminance(), 1, 2e-4f) << name;
  for (const double t : {1.0, 500.0, 1000.0, 1900.0, 2856.0, 6500.0, 20000.0, 1e9}) {
    const RGB c = emission_to_rgb(blackbody(t));
    EXPECT_NEAR(c.luminance(), 1, 2e-4f) << t;
    EXPECT_GE(c.min(), 0) << t;
  }
  expect_near(emission_to_rgb(named("stdillum-D65")), RGB(1), 5e-4f);
  EXPECT_EQ(emission_to_rgb(SampledSpectrum({900, 1000}, {1, 1})), RGB(0));
  EXPECT_EQ(emission_to_rgb(SampledSpectrum({550}, {1})), RGB(0));  // no width, no energy
  EXPECT_EQ(emission_to_rgb(SampledSpectrum::constant(0)), RGB(0));
}

// A line much narrower than the observer's table is not missed, and has the observer's chromaticity there.
TEST(Emission, NarrowLines) {
  const XYZ c = integrate_xyz(SampledSpectrum({589.29f, 589.30f, 589.31f}, {0, 100, 0}));
  const XYZ want = colour_matching(589.3);
  EXPECT_NEAR(c.y, want.y, 1e-3);
  EXPECT_NEAR(c.x / c.y, want.x / want.y, 1e-5);
}

// Planckian locus: CIE 1931 chromaticities (Wyszecki & Stiles).
TEST(Blackbody, LiesOnThePlanckianLocus) {
  const std::array<double, 3> published[] = {{1000, 0.6528, 0.3444}, {2000, 0.5267, 0.4133}, {2856, 0.4475, 0.4074},
                                             {4000, 0.3805, 0.3768}, {6500, 0.3135, 0.3237}, {10000, 0.2807, 0.2884}};
  for (const auto& [t, x, y] : published) {
    const XYZ c = integrate_xyz(blackbody(t));
    const double sum = c.x + c.y + c.z;
    EXPECT_NEAR(c.x / sum, x, 3e-4) << t;
    EXPECT_NEAR(c.y / sum, y, 3e-4) << t;
  }
  EXPECT_THROW(blackbody(0), std::invalid_argument);
  EXPECT_THROW(blackbody(-5), std::invalid_argument);
  EXPECT_THROW(blackbody(std::nan("")), std::invalid_argument);
}

TEST(Blackbody, PlanckObeysWienAndStefanBoltzmann) {
  const double t = 5000, peak = 2.897771955e6 / t;
  EXPECT_GT(planck(peak, t), planck(peak * 1.001, t));
  EXPECT_GT(planck(peak, t), planck(peak * 0.999, t));
  double total = 0;  // trapezium in log(wavelength)
  const double step = 1e-3;
  for (double l = std::log(50.0); l < std::log(1e6); l += step)
    total += planck(std::exp(l), t) * std::exp(l) * 1e-9 * step;
  EXPECT_NEAR(total * std::numbers::pi / (5.670374419e-8 * std::pow(t, 4)), 1, 1e-5);
  for (const double nm : {400.0, 550.0, 800.0})
    EXPECT_NEAR(blackbody(t)(nm) / blackbody(t)(600), planck(nm, t) / planck(600, t), 1e-6);
}

TEST(Reflectance, ConstantsKeepTheirValue) {
  for (const float c : {0.0f, 0.2f, 1.0f}) expect_near(reflectance_to_rgb(SampledSpectrum::constant(c)), RGB(c), 1e-6f);
  expect_near(unbounded_to_rgb(SampledSpectrum({500}, {7.5f})), RGB(7.5f), 1e-5f);
  expect_near(reflectance_to_rgb(SampledSpectrum({400, 700}, {0.5f, 0.5f})), RGB(0.5f), 1e-6f);
}

TEST(Reflectance, IsLinearAndOrdersColours) {
  const SampledSpectrum red({580, 600}, {0, 1}), cyan({580, 600}, {1, 0});
  const RGB r = reflectance_to_rgb(red), c = reflectance_to_rgb(cyan);
  expect_near(r + c, RGB(1), 1e-5f);
  EXPECT_GT(r.r, 0.8f);
  EXPECT_LT(r.b, 0.05f);
  EXPECT_GT(c.b, 0.9f);
}

// Index at the d line (587.56 nm) and Abbe number of SCHOTT's data sheets check the coefficients.
TEST(NamedSpectra, Glasses) {
  struct {
    const char* name;
    double nd, abbe;
  } const sheet[] = {{"glass-BK7", 1.51680, 64.17},   {"glass-BAF10", 1.67003, 47.11}, {"glass-FK51A", 1.48656, 84.47},
                     {"glass-LASF9", 1.85025, 32.17}, {"glass-F5", 1.67270, 32.21},    {"glass-SF10", 1.72825, 28.41},
                     {"glass-F11", 1.78472, 25.76}};
  for (const auto& g : sheet) {
    const SampledSpectrum s = named(g.name);
    EXPECT_NEAR(s(587.5618), g.nd, 3e-5) << g.name;
    EXPECT_NEAR((s(587.5618) - 1) / (s(486.1327) - s(656.2725)), g.abbe, 0.1) << g.name;
  }
}

TEST(NamedSpectra, CrystalsAndNames) {
  EXPECT_NEAR(named("metal-MgO-eta")(589.3), 1.7374, 5e-4);  // Stephens & Malitson at 589.3 nm
  EXPECT_NEAR(named("metal-TiO2-eta")(589.3), 2.613, 2e-3);  // DeVore
  EXPECT_EQ(named("metal-TiO2-k")(500), 0);
  EXPECT_EQ(named("glass-F10")(500), named("glass-SF10")(500));
  EXPECT_FALSE(find_named_spectrum("metal-Unobtainium-eta"));
  EXPECT_FALSE(find_named_spectrum(""));
  std::set<std::string_view> names;
  for (const std::string_view n : spectrum_names()) {
    EXPECT_TRUE(names.insert(n).second) << n;
    const SampledSpectrum s = named(n);
    EXPECT_LE(s.wavelengths().front(), 380) << n;
    EXPECT_GE(s.wavelengths().back(), 780) << n;
    EXPECT_GE(s.min(), 0) << n;
  }
  EXPECT_EQ(names.size(), 16u + 10 + 14);
}

TEST(ParseSpectrum, ReadsPairsAndComments) {
  const SampledSpectrum s = parse_spectrum("# head\n 400 0.5, 500.5\t+1e0 # tail 7\r\n600 2", "x.spd");
  EXPECT_EQ(s.wavelengths(), (std::vector<float>{400, 500.5f, 600}));
  EXPECT_EQ(s.values(), (std::vector<float>{0.5f, 1, 2}));
}

TEST(ParseSpectrum, NamesTheLineOfAFault) {
  const std::pair<const char*, const char*> bad[] = {{"", "x.spd"},
                                                     {"# only\n", "x.spd"},
                                                     {"400 1\n300 2", "x.spd:2:1"},
                                                     {"400 1\n500", "x.spd:2:1"},
                                                     {"400 nan", "x.spd:1:5"},
                                                     {"400 1e99", "x.spd:1:5"},
                                                     {"inf 1", "x.spd:1:1"},
                                                     {"400 1x", "x.spd:1:5"},
                                                     {"-400 1", "x.spd:1:1"},
                                                     {"400 0x10", "x.spd:1:5"},
                                                     {"400 --1", "x.spd:1:5"},
                                                     {"400 +", "x.spd:1:5"}};
  for (const auto& [text, where] : bad) {
    try {
      parse_spectrum(text, "x.spd");
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).rfind(where, 0), 0u) << e.what();
    }
  }
}

// Any bytes: a spectrum or an InputError.
TEST(ParseSpectrum, SurvivesNoise) {
  for (uint64_t i = 0; i < 3000; ++i) {
    KeyedRng rng(i);
    std::string text;
    const char alphabet[] = "0123456789.e+-# \n,x\0\xff";
    for (uint64_t n = rng.next_bits() % 60; n > 0; --n) text += alphabet[rng.next_bits() % (sizeof(alphabet) - 1)];
    try {
      EXPECT_FALSE(parse_spectrum(text, "noise").values().empty());
    } catch (const InputError&) {
    }
  }
}

TEST(ReadSpectrumFile, ReportsWhatItCannotRead) {
  const FileLoc loc{"scene.pbrt", 3, 4};
  EXPECT_THROW(read_spectrum_file("/no/such/file.spd", loc), InputError);
  EXPECT_THROW(read_spectrum_file(std::filesystem::temp_directory_path().string(), loc), InputError);
  const auto path = std::filesystem::temp_directory_path() / "dapple_spectrum_test.spd";
  std::ofstream(path) << "400 1\n700 2\n";
  EXPECT_EQ(read_spectrum_file(path.string(), loc)(550), 1.5);
  std::ofstream(path) << std::string((size_t(4) << 20) + 1, ' ');
  EXPECT_THROW(read_spectrum_file(path.string(), loc), InputError);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace dapple
