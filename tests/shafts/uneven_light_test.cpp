// SPDX-License-Identifier: Apache-2.0
// Light of uneven media along rays in scan planes, where these media are such that closed forms are known.
#include "dapple/shafts/uneven_light.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/media/pattern_medium.h"
#include "tests/shafts/scan_plane_oracle.h"

namespace dapple {
namespace {

using media::PatternMedium;
using shafts::AirLight;
using shafts::Haze;
using shafts::LightDepths;
using shafts::ScanPlanes;
using shafts::Segment;
using shafts::UnevenLight;
using test::Triangle;

const RGB sigma_a(0.02f, 0.01f, 0), sigma_s(0.06f, 0.1f, 0.05f);
constexpr float g = 0.4f, in_the_plane = 0.5f;
const Box3f box(V3f(-12, -12, -1), V3f(12, 12, 7));

class Fall final : public pattern::FloatTexture {
 public:
  void evaluate(const pattern::ShadingPoints& points, float* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = std::exp(-points.P[i].z / 3);
  }
  pattern::TextureReads reads() const override { return pattern::TextureReads::surface; }
};

PatternMedium medium_of(bool layered) {
  PatternMedium::Content c;
  c.box = box;
  c.sigma_a = pattern::Input<RGB>(sigma_a), c.sigma_s = pattern::Input<RGB>(sigma_s);
  if (layered) c.density = pattern::Input<float>(std::make_shared<Fall>()), c.density_bound = std::exp(1 / 3.0f);
  return {std::move(c), Transform(), {g}, "test"};
}

double density(double z, bool layered) {
  return layered ? std::exp(-z / 3) : 1;
}

// Of a straight way of this length between two heights.
double column(double length, double z0, double z1, bool layered) {
  const double y = (z1 - z0) / 3;
  return !layered ? length : length * std::exp(-z0 / 3) * (std::abs(y) < 1e-9 ? 1 : -std::expm1(-y) / y);
}

double phase(double cosine) {
  const double G = double(g);
  return (1 - G * G) / (4 * M_PI * std::pow(1 + G * G - 2 * G * cosine, 1.5));
}

ScanPlanes::Settings settings_to(const V3f& axis, float lamp) {
  ScanPlanes::Settings s;
  s.eye = V3f(0.3f, -0.2f, 1.5f), s.axis = axis, s.lamp = lamp;
  s.farthest = lamp < infinity ? pi : 40, s.nearest = lamp < infinity ? 0.01f : 0.5f;
  s.fan.planes = 32, s.fan.step = 2 * pi / 32;
  return s;
}

V3f in_plane(const ScanPlanes& planes, int k, double phi) {
  return normalize(planes.frame().n * float(std::cos(phi)) + planes.across(k) * float(std::sin(phi)));
}

// Slats across the sun, each 1 m, 2 m apart, 9 m up: beyond the box.
std::vector<Triangle> slats() {
  std::vector<Triangle> all;
  for (int i = -20; i < 20; ++i) {
    const V3f o(float(2 * i), -60, 9), x(1, 0, 0), y(0, 120, 0);
    all.push_back({{o, o + x, o + y}}), all.push_back({{o + x, o + x + y, o + y}});
  }
  return all;
}

struct Case {
  const char* name;
  bool layered, blocked;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}
// Of a ray, where it leaves the box, at most `end`.
double end_in_box(const V3f& o, const V3f& d, double end) {
  for (int axis = 0; axis < 3; ++axis)
    if (d[axis] != 0) end = std::min(end, double(((d[axis] > 0 ? box.max : box.min)[axis] - o[axis]) / d[axis]));
  return end;
}

class UnevenSun : public testing::TestWithParam<Case> {};

// Rationale: a pattern that is even, or thins out upwards, in a box under a sun, with and without slats above it.
// Expectation: the mean over draws is the integral of lit parts, exact intervals: of one direction within .5 %, and
// within 4 % where slats cut it, as bins are lit or dark as a whole (half a bin an edge) and the coefficients of a
// stratum are those of a random point, lit or not; of all directions within .2 %. One draw is off by at most 20 %, and
// by less than 5 % RMS over rays and draws.
TEST_P(UnevenSun, IsTheIntegral) {
  const V3f sun = normalize(V3f(0.4f, 0.3f, 0.8f));
  ScanPlanes planes(settings_to(sun, infinity));
  const auto roof = GetParam().blocked ? slats() : std::vector<Triangle>();
  test::fill(planes, [&](const V3f& o, const V3f& d) { return test::highest_of(roof, o, d); });
  const bool layered = GetParam().layered;
  const PatternMedium medium = medium_of(layered);
  const AirLight lit(planes, Haze{});
  const UnevenLight light(lit, medium, std::make_shared<LightDepths>(medium, LightDepths::Settings{.light = sun}));
  double squares = 0, all = 0;
  int count = 0;
  for (int k = 1; k < 32; k += 5)
    for (const double phi : {GetParam().blocked ? 0.05 : 0.0, 0.4, 1.1, 1.9, 2.7}) {
      const V3f d = in_plane(planes, k, phi), eye = planes.settings().eye;
      const double end = end_in_box(eye, d, 10);
      RGB expected;
      constexpr int steps = 4000;
      for (const auto& [a, b] : test::lit_intervals(roof, eye, sun, d, end))
        for (int i = 0; i < steps; ++i) {
          const double s = a + (b - a) * (i + 0.5) / steps, z = double(eye.z) + s * double(d.z);
          const V3d P = V3d(eye) + V3d(d) * s;
          double up = INFINITY;  // out of the box
          for (int axis = 0; axis < 3; ++axis) up = std::min(up, (double(box.max[axis]) - P[axis]) / double(sun[axis]));
          const double depth = column(s, double(eye.z), z, layered) + column(up, z, z + up * double(sun.z), layered);
          for (int c = 0; c < 3; ++c)
            expected[c] += float(density(z, layered) * std::exp(-double(sigma_a[c] + sigma_s[c]) * depth) *
                                 double(sigma_s[c]) * phase(double(dot(d, sun))) * (b - a) / steps);
        }
      if (expected.g < 1e-6f) {  // all of it along a slat
        EXPECT_LT(light.in_scattering({d, 0, 10, in_the_plane}, eye, 1).g, 1e-6f);
        continue;
      }
      double mean = 0;
      for (int i = 0; i < 512; ++i) {
        const RGB found = light.in_scattering({d, 0, 10, in_the_plane}, eye, hash(k, phi, i));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.2f * expected[c]) << k << " " << phi;
        mean += double(found.g) / 512;
        squares += double(sqr(found.g / expected.g - 1)), ++count;
      }
      EXPECT_NEAR(mean, double(expected.g), (GetParam().blocked ? 0.04 : 0.005) * double(expected.g))
          << k << " " << phi;
      all += mean / double(expected.g) - 1;
    }
  EXPECT_LT(std::sqrt(squares / count), 0.05);
  EXPECT_LT(std::abs(all / (count / 512.0)), 0.002);
}

INSTANTIATE_TEST_SUITE_P(All, UnevenSun,
                         testing::Values(Case{"even", false, false}, Case{"layered", true, false},
                                         Case{"even_slats", false, true}, Case{"layered_slats", true, true}),
                         [](const auto& test) { return std::string(test.param.name); });

// Rationale: a lamp in the box, past which the rays go, at .04 to 4 m. Expectation: quadrature within 1 % on the mean.
TEST(UnevenLamp, IsTheIntegral) {
  const V3f axis = normalize(V3f(0.3f, 0.9f, 0.3f));
  const ScanPlanes planes(settings_to(axis, 4));
  const V3d lamp = V3d(planes.settings().eye) + V3d(axis) * 4.0;
  for (const bool layered : {false, true}) {
    const PatternMedium medium = medium_of(layered);
    const AirLight lit(planes, Haze{});
    const UnevenLight light(
        lit, medium, std::make_shared<LightDepths>(medium, LightDepths::Settings{.is_lamp = true, .light = V3f(lamp)}));
    for (const double phi : {0.01, 0.1, 0.8, 1.6, 2.8}) {
      const V3f d = in_plane(planes, 3, phi), eye = planes.settings().eye;
      const double sine = std::sin(phi), end = end_in_box(eye, d, 6);
      const auto angle = [&](double s) { return std::atan2(s * sine, 4 - s * std::cos(phi)); };
      double expected = 0;
      constexpr int steps = 20000;
      for (int i = 0; i < steps; ++i) {
        const double psi = angle(end) * (i + 0.5) / steps, s = 4 * std::sin(psi) / std::sin(phi + psi);
        const V3d P = V3d(eye) + V3d(d) * s;
        const double r = (P - lamp).length();
        expected += density(P.z, layered) * phase(std::cos(phi + psi)) *
                    std::exp(-0.11 * (column(s, double(eye.z), P.z, layered) + column(r, lamp.z, P.z, layered)));
      }
      expected *= 0.1 * angle(end) / steps / (4 * sine);
      double mean = 0;
      for (int i = 0; i < 256; ++i)
        mean += double(light.in_scattering({d, 0, 6, in_the_plane}, eye, hash(phi, i)).g) / 256;
      EXPECT_NEAR(mean, expected, 0.01 * expected) << layered << " " << phi;
    }
  }
}

// Rationale: light enters at a level surface inside the medium. Expectation: what is above it does not weaken it: as in
// AirLight, with an even medium, within 1 %.
TEST(UnevenLight, CountsFromWhereLightEnters) {
  const V3f sun = normalize(V3f(0.4f, 0.3f, 0.8f));
  auto settings = settings_to(sun, infinity);
  settings.bounded = true;
  ScanPlanes planes(settings);
  const AirLight lit(planes, Haze{});
  for (int k = 0; k < planes.planes(); ++k) {
    for (int j = 0; j < planes.bins(); ++j) {
      const V3f foot = planes.foot(k, 0.5f * (planes.edge(j) + planes.edge(j + 1)));
      planes.entry(k)[j] = lit.entry_of(foot + sun * ((4 - foot.z) / sun.z));
    }
    planes.close(k);
  }
  Haze haze;
  haze.sigma_s = sigma_s, haze.sigma_t = sigma_s + sigma_a, haze.phase.g = g;
  const PatternMedium medium = medium_of(false);
  const AirLight exact(planes, haze);
  const UnevenLight light(lit, medium, std::make_shared<LightDepths>(medium, LightDepths::Settings{.light = sun}));
  for (const double phi : {0.7, 1.4, 2.2}) {
    const Segment segment{in_plane(planes, 7, phi), 0, 2.5f, in_the_plane};
    const RGB expected = exact.in_scattering(segment);
    double mean = 0;
    for (int i = 0; i < 64; ++i) mean += double(light.in_scattering(segment, settings.eye, hash(i)).g) / 64;
    EXPECT_GT(expected.g, 0);
    EXPECT_NEAR(mean, double(expected.g), 0.01 * double(expected.g)) << phi;
  }
}

}  // namespace
}  // namespace dapple
