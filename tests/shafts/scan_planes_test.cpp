// SPDX-License-Identifier: Apache-2.0
// Planes and the light along rays in them, against closed forms, quadrature, and the exact lists of Max (1986).
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/shafts/air_light.h"
#include "tests/shafts/scan_plane_oracle.h"

namespace dapple {
namespace {

using shafts::AirLight;
using shafts::FilmDirection;
using shafts::fit_planes;
using shafts::Haze;
using shafts::ScanPlanes;
using shafts::Segment;
using test::fill;
using test::highest_of;
using test::lit_intervals;
using test::Triangle;

constexpr double sigma_s = 0.06, sigma_t = 0.08;

Haze even(RGB s = RGB(float(sigma_s)), RGB t = RGB(float(sigma_t)), float g = 0) {
  Haze haze;
  haze.sigma_s = s, haze.sigma_t = t, haze.phase.g = g;
  return haze;
}

Haze layered(float scale_height, float g = 0) {
  Haze haze = even(RGB(float(sigma_s)), RGB(float(sigma_t)), g);
  haze.density.slope = V3f(0, 0, 1 / scale_height);
  return haze;
}

V3f direction(double elevation, double azimuth) {
  return normalize(V3f(float(std::cos(elevation) * std::cos(azimuth)), float(std::cos(elevation) * std::sin(azimuth)),
                       float(std::sin(elevation))));
}

ScanPlanes::Settings planes_to(const V3f& axis, float farthest, int bins = 1024, int planes = 64) {
  ScanPlanes::Settings s;
  s.eye = V3f(0.3f, -0.2f, 1.5f);
  s.axis = axis;
  s.nearest = farthest / 500;
  s.farthest = farthest;
  s.bins = bins;
  s.fan.planes = planes;
  s.fan.step = 2 * pi / float(planes);
  return s;
}

// Of a direction that lies in a plane, and may be off by rounding.
constexpr float in_the_plane = 0.5f;

V3f in_plane(const ScanPlanes& planes, int k, double phi) {
  return normalize(planes.frame().n * float(std::cos(phi)) + planes.across(k) * float(std::sin(phi)));
}

double simpson(double a, double b, const std::function<double(double)>& f) {
  constexpr int steps = 20000;
  double sum = f(a) + f(b);
  for (int i = 1; i < steps; ++i) sum += f(a + (b - a) * i / steps) * (i % 2 ? 4 : 2);
  return sum * (b - a) / steps / 3;
}

double henyey_greenstein(double g, double cosine) {
  return (1 - g * g) / (4 * M_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

// Rationale: a slab of even haze, lit from above, seen in all directions, to the sun and away from it too. Expectation:
// the integral by quadrature, colours each by their own, within the rounding of floats, 1e-5; under a level top, which
// the ray of a bin meets in its middle, 1e-4. The same whether blocks know the top by a line or by rays of light.
TEST(AirLight, ClearSlabIsTheIntegral) {
  for (const double elevation : {1.2, -1.2, 0.3, -0.3}) {
    const V3f sun = direction(std::abs(elevation), 0.4);
    auto settings = planes_to(sun, 50);
    settings.bounded = true;
    settings.entry_error = elevation > 0 ? 1e-3f : 0;
    ScanPlanes planes(settings);
    const Haze haze = even(RGB(0.06f, 0.03f, 1e-7f), RGB(0.08f, 0.09f, 2e-7f), 0.4f);
    const AirLight light(planes, haze);
    constexpr double top = 8;                  // z
    for (const bool across : {true, false}) {  // across the sun; level
      const V3f normal = across ? sun : V3f(0, 0, 1);
      for (int k = 0; k < planes.planes(); ++k) {
        for (int j = 0; j < planes.bins(); ++j) {
          const V3f foot = planes.foot(k, 0.5f * (planes.edge(j) + planes.edge(j + 1)));
          planes.entry(k)[j] = light.entry_of(foot + sun * ((float(top) - dot(foot, normal)) / dot(sun, normal)));
        }
        planes.close(k);
      }
      for (const double phi : {0.0, 1e-4, 0.1, 1.0, M_PI / 2, 2.0, 3.0, M_PI}) {
        const V3f d = in_plane(planes, 11, phi);
        const Segment segment{d, 0.7f, 4.9f, in_the_plane};
        const RGB found = light.in_scattering(segment);
        for (int c = 0; c < 3; ++c) {
          const double t = double(haze.sigma_t[c]);
          const double expected = simpson(0.7, double(4.9f),
                                          [&](double s) {
                                            const double to_sun =
                                                (top - double(dot(settings.eye, normal)) - s * double(dot(d, normal))) /
                                                double(dot(sun, normal));
                                            return std::exp(-t * (s - 0.7 + to_sun));
                                          }) *
                                  double(haze.sigma_s[c]) * henyey_greenstein(0.4, double(dot(d, sun)));
          EXPECT_NEAR(double(found[c]), expected, (across ? 1e-5 : 1e-4) * expected) << phi << " " << c;
        }
      }
    }
  }
}

struct Look {
  double elevation, azimuth;
};

// Rationale: haze that thins out upwards, without bounds: downwards, level, upwards, steeper and flatter than the sun,
// along it and against it; nearly even haze; and thin haze. Expectation: quadrature within 1e-5.
TEST(AirLight, ClearLayeredHazeIsTheIntegral) {
  for (const float scale_height : {2.0f, 40.0f, 4000.0f}) {
    for (const double sun_elevation : {0.2, 0.8, 1.5707}) {
      const V3f sun = direction(sun_elevation, 1);
      const ScanPlanes planes(planes_to(sun, 60));
      for (const float density : {1.0f, 1e-6f}) {
        Haze haze = layered(scale_height, -0.3f);
        haze.sigma_s *= density, haze.sigma_t *= density;
        if (scale_height > 1000 && density == 1) continue;  // nothing gets through
        const AirLight light(planes, haze);
        for (const Look look : {Look{-0.5, 0},
                                {-1e-5, 2},
                                {0, 1},
                                {1e-4, 3},
                                {sun_elevation, 1},
                                {sun_elevation, 2},
                                {sun_elevation - 0.01, 1},
                                {1.3, 5},
                                {-sun_elevation, 1 + M_PI}}) {
          const V3f d = direction(look.elevation, look.azimuth);
          const double end = look.elevation < -0.1 ? 2.5 : 30, rate = double(d.z) / double(scale_height);
          const double x0 = std::exp(-1.5 / double(scale_height)), t = double(haze.sigma_t.g);
          const double expected = simpson(0, double(float(end)),
                                          [&](double s) {
                                            const double x = x0 * std::exp(-rate * s);
                                            const double view = rate == 0 ? x0 * s : -x0 * std::expm1(-rate * s) / rate;
                                            return x * std::exp(-t * (view + x * double(scale_height) / double(sun.z)));
                                          }) *
                                  double(haze.sigma_s.g) * henyey_greenstein(-0.3, double(dot(d, sun)));
          const RGB found = light.in_scattering({d, 0, float(end)});
          EXPECT_NEAR(double(found.g), expected, 1e-5 * expected)
              << scale_height << " " << sun_elevation << " " << look.elevation << " " << density;
        }
      }
    }
  }
}

// Rationale: to infinity, up and down; the sun below the horizon; even haze without bounds. Expectation: closed form;
// nothing.
TEST(AirLight, EndsAtInfinity) {
  const V3f sun = direction(0.6, 0), up = direction(1.1, 2);
  const ScanPlanes planes(planes_to(sun, 60));
  const double H = 5, x0 = std::exp(-1.5 / H), k = 1 - double(up.z) / double(sun.z), T = sigma_t * H * x0;
  // l from 0 to H x0 / mu: sigma_s p e^(-T / mu_s) (1 - e^(-k T / mu)) / (k sigma_t).
  const double expected =
      sigma_s / sigma_t / (4 * M_PI) * std::exp(-T / double(sun.z)) * -std::expm1(-k * T / double(up.z)) / k;
  EXPECT_NEAR(double(AirLight(planes, layered(5)).in_scattering({up, 0, infinity}).g), expected, 1e-5 * expected);
  const RGB down = AirLight(planes, layered(5)).in_scattering({direction(-0.4, 1), 0, infinity});
  EXPECT_TRUE(down.is_finite() && down.min() > 0);
  const ScanPlanes night(planes_to(direction(-0.1, 0), 60));
  EXPECT_TRUE(AirLight(night, layered(5)).in_scattering({up, 0, 10}).is_black());
  EXPECT_TRUE(AirLight(planes, even()).in_scattering({up, 0, 10}).is_black());
}

// Light of exact lit intervals, thin haze: their length.
double thin_light(const std::vector<std::pair<double, double>>& lit) {
  double length = 0;
  for (const auto& [a, b] : lit) length += b - a;
  return length;
}

Haze thin() {
  Haze haze = even(RGB(1), RGB(0));
  return haze;
}

Triangle triangle(V3f a, V3f b, V3f c) {
  return {{a, b, c}};
}

std::vector<Triangle> quad(const V3f& o, const V3f& x, const V3f& y) {
  return {triangle(o, o + x, o + y), triangle(o + x, o + x + y, o + y)};
}

// Rationale: a roof whose edge throws one shadow. Expectation: below it dark, the rest lit, where the edge falls within
// half a bin.
TEST(ScanPlanes, RoofThrowsOneShadow) {
  const V3f sun = direction(0.9, 0);
  ScanPlanes planes(planes_to(sun, 100, 2048, 128));
  const auto roof = quad(V3f(6, -500, 20), V3f(700, 0, 0), V3f(0, 1000, 0));
  fill(planes, [&](const V3f& o, const V3f& d) { return highest_of(roof, o, d); });
  const AirLight light(planes, thin());
  for (int k = 0; k < planes.planes(); k += 7)
    for (const double phi : {0.2, 0.8, 1.3, 2.0, 2.8}) {
      const V3f d = in_plane(planes, k, phi);
      const auto lit = lit_intervals(roof, planes.settings().eye, sun, d, 40);
      ASSERT_LE(lit.size(), 2u);
      const double found = double(light.in_scattering({d, 0, 40, in_the_plane}).g) * 4 * M_PI,
                   expected = thin_light(lit);
      const int bin = std::min(planes.bin_of(float(40 * std::sin(phi))), planes.bins() - 1);
      const double half_bin = 0.5 * double(planes.edge(bin + 1) - planes.edge(bin)) / std::sin(phi);
      EXPECT_NEAR(found, expected, half_bin + 1e-3) << k << " " << phi;
    }
}

// Rationale: slats of period 1 m, a third of it dark. Expectation: exact intervals, half a bin at each edge at most,
// and by far less on the whole; the same seen against the light, across it and from behind.
TEST(ScanPlanes, CombOfSlats) {
  const V3f sun = direction(0.7, 0.3);
  ScanPlanes planes(planes_to(sun, 60, 2048, 64));
  std::vector<Triangle> slats;
  for (int i = -40; i < 40; ++i)
    for (const Triangle& t : quad(V3f(float(i), -200, 12), V3f(1 / 3.0f, 0, 0), V3f(0, 400, 0))) slats.push_back(t);
  fill(planes, [&](const V3f& o, const V3f& d) { return highest_of(slats, o, d); });
  const AirLight light(planes, thin());
  double worst = 0, sum = 0;
  int count = 0;
  for (int k = 0; k < planes.planes(); k += 5)
    for (const double phi : {0.5, 1.0, 1.57, 2.2}) {
      const V3f d = in_plane(planes, k, phi);
      if (std::abs(d.x) < 0.2f) continue;  // along the slats: one edge is all
      const auto lit = lit_intervals(slats, planes.settings().eye, sun, d, 14);
      const double found = double(light.in_scattering({d, 0, 14, in_the_plane}).g) * 4 * M_PI,
                   expected = thin_light(lit);
      const int bin = planes.bin_of(float(14 * std::sin(phi)));
      const double half_bin = 0.5 * double(planes.edge(bin + 1) - planes.edge(bin)) / std::sin(phi);
      EXPECT_NEAR(found, expected, half_bin * double(2 * lit.size()));
      worst = std::max(worst, std::abs(found - expected) / 14), sum += (found - expected) / 14, ++count;
    }
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(std::abs(sum / count), 0.001);
}

std::vector<Triangle> random_triangles(uint64_t seed, int n) {
  KeyedRng rng(seed);
  const auto point = [&] { return V3f(rng.next() * 20 - 10, rng.next() * 20 - 10, rng.next() * 14); };
  std::vector<Triangle> all;
  for (int i = 0; i < n; ++i) {
    const V3f a = point();
    const auto near = [&] { return a + (point() - V3f(0, 0, 7)) * 0.2f; };
    all.push_back(triangle(a, near(), near()));
  }
  return all;
}

// Rationale: a hundred triangles around the eye, in front of it, behind, above and below. Expectation: the exact lists,
// each edge within half a bin; even haze between them by the same intervals.
TEST(ScanPlanes, RandomTrianglesAsExactLists) {
  for (const uint64_t seed : {1, 2, 3}) {
    const V3f sun = direction(0.5 + 0.3 * double(seed), double(seed));
    const auto triangles = random_triangles(seed, 100);
    ScanPlanes planes(planes_to(sun, 40, 2048, 32));
    fill(planes, [&](const V3f& o, const V3f& d) { return highest_of(triangles, o, d); });
    const AirLight light(planes, thin()), haze(planes, layered(6));
    double sum = 0, mean = 0;
    for (int k = 0; k < planes.planes(); ++k)
      for (int i = 1; i < 24; ++i) {
        const double phi = M_PI * i / 24;
        const V3f d = in_plane(planes, k, phi);
        const auto lit = lit_intervals(triangles, planes.settings().eye, sun, d, 15);
        const double found = double(light.in_scattering({d, 0, 15, in_the_plane}).g) * 4 * M_PI,
                     expected = thin_light(lit);
        const int bin = std::min(planes.bin_of(float(15 * std::sin(phi))), planes.bins() - 1);
        const double half_bin = 0.5 * double(planes.edge(bin + 1) - planes.edge(bin)) / std::sin(phi);
        EXPECT_NEAR(found, expected, half_bin * double(2 * lit.size() + 2) + 1e-4) << seed << " " << k << " " << phi;
        sum += found - expected, mean += expected;
        const double x0 = std::exp(-1.5 / 6), rate = double(d.z) / 6;
        double through = 0;
        for (const auto& [a, b] : lit)
          through += simpson(a, b, [&](double s) {
            const double x = x0 * std::exp(-rate * s);
            return x * std::exp(-sigma_t *
                                (x0 * s * -std::expm1(-rate * s - 1e-12) / (rate * s + 1e-12) + x * 6 / double(sun.z)));
          });
        through *= sigma_s / (4 * M_PI);
        const double in_haze = double(haze.in_scattering({d, 0, 15, in_the_plane}).g);
        EXPECT_NEAR(in_haze, through, 0.02 * through + sigma_s / (4 * M_PI) * half_bin * double(2 * lit.size() + 2));
      }
    EXPECT_NEAR(sum / mean, 0, 2e-4) << "bins are right on the mean";
  }
}

// Rationale: a ball's shadow is a cylinder, whose lit lengths are roots of a quadratic. Expectation: over a picture of
// 64 x 64 by the planes that fit it, the mean within .2 % and RMS within 1 % of what a clear ray gets.
TEST(ScanPlanes, BallsShadowIsACylinder) {
  const V3f sun = direction(0.8, 2), centre(0, 9, 5);
  constexpr float radius = 2, end = 20;
  auto settings = planes_to(sun, 30);
  constexpr int side = 64;
  const auto look = [&](float x, float y) {
    return normalize(V3f((x - side / 2) / (side / 2.0f) * 0.6f, 1, (side / 2 - y) / (side / 2.0f) * 0.6f));
  };
  std::vector<FilmDirection> corners, inside;
  for (const float x : {0.0f, float(side)})
    for (const float y : {0.0f, float(side)}) corners.push_back({look(x, y), 1.2f / side * look(x, y).y});
  inside.push_back({look(side / 2, side / 2), 1.2f / side});
  settings.fan = fit_planes(Frame(sun), corners, inside, 1);
  EXPECT_LT(settings.fan.planes, 400);
  ScanPlanes planes(settings);
  fill(planes, [&](const V3f& o, const V3f& d) {
    const V3f w = o - centre;
    const double b = double(dot(w, d)), c = double(dot(w, w)) - double(radius * radius);
    return b * b < c ? -INFINITY : -b + std::sqrt(b * b - c);
  });
  const AirLight light(planes, thin());
  double sum = 0, squares = 0, all = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const V3f d = look(float(x) + 0.5f, float(y) + 0.5f);
      // Dark: in the cylinder around the axis through the ball, and below it.
      const V3d w = V3d(settings.eye) - V3d(centre), l(sun), v(d);
      const V3d wp = w - l * w.dot(l), vp = v - l * v.dot(l);
      const double a = vp.dot(vp), b = wp.dot(vp), c = wp.dot(wp) - double(radius * radius);
      const double s_in = b * b - a * c > 0 ? std::max((-b - std::sqrt(b * b - a * c)) / a, 0.0) : double(end),
                   s_out = b * b - a * c > 0 ? std::min((-b + std::sqrt(b * b - a * c)) / a, double(end)) : double(end);
      double dark = 0;
      constexpr int steps = 2000;
      for (int i = 0; i < steps && s_out > s_in; ++i) {
        const double s = s_in + (s_out - s_in) * (i + 0.5) / steps;
        const V3d P = w + v * s;
        const V3d across = P - l * P.dot(l);
        dark += P.dot(l) < std::sqrt(std::max(double(radius * radius) - across.dot(across), 0.0))
                    ? (s_out - s_in) / steps
                    : 0;
      }
      const double expected = double(end) - dark;
      double found = 0;
      for (int i = 0; i < 4; ++i) found += double(light.in_scattering({d, 0, end, (float(i) + 0.5f) / 4}).g) * M_PI;
      sum += found - expected, squares += sqr(float(found - expected)), all += expected;
    }
  EXPECT_LT(std::abs(sum / all), 0.002);
  EXPECT_LT(std::sqrt(squares / (side * side)) / double(end), 0.01);
  EXPECT_LT(all / (side * side), 0.99 * double(end)) << "there is a shadow";
}

// Rationale: a lamp in even and in layered haze, seen past it, beside it and with the back to it. Expectation:
// quadrature within 1e-4.
TEST(AirLight, ClearLampIsTheIntegral) {
  const V3f axis = direction(0.3, 1);
  auto settings = planes_to(axis, pi, 1024, 16);
  settings.lamp = 4;
  settings.nearest = 0.002f;
  const ScanPlanes planes(settings);
  const V3d lamp = V3d(settings.eye) + V3d(planes.frame().n) * 4.0;
  for (const float g : {0.0f, 0.6f})
    for (const Haze& haze : {even(RGB(0.06f), RGB(0.08f), g), layered(3, g)})
      for (const double phi : {0.002, 0.05, 0.7, 1.5708, 2.5, 3.1})
        for (const float begin : {0.0f, 1.0f}) {
          const V3f d = in_plane(planes, 5, phi);
          const double H = haze.density.is_constant() ? INFINITY : 3;
          const auto column = [&](const V3d& a, const V3d& b) {
            const double y = (b.z - a.z) / H;
            return std::exp(-a.z / H) * (b - a).length() * (y == 0 ? 1 : -std::expm1(-y) / y);
          };
          const V3d from = V3d(settings.eye) + V3d(d) * double(begin);
          // Over the angle at the lamp, in which the integrand is smooth.
          const double sine = std::sin(phi);
          const auto angle = [&](double s) { return std::atan2(s * sine, 4 - s * std::cos(phi)); };
          const double expected = simpson(angle(double(begin)), angle(12),
                                          [&](double psi) {
                                            const double s = 4 * std::sin(psi) / std::sin(phi + psi);
                                            const V3d P = V3d(settings.eye) + V3d(d) * s;
                                            return std::exp(-P.z / H) *
                                                   henyey_greenstein(double(g), std::cos(phi + psi)) *
                                                   std::exp(-0.08 * (column(from, P) + column(lamp, P)));
                                          }) *
                                  0.06 / (4 * sine);
          const RGB found = AirLight(planes, haze).in_scattering({d, begin, 12, in_the_plane});
          // Beside the lamp a bin holds much of what is behind it.
          EXPECT_NEAR(double(found.g), expected, (phi < 0.01 ? 1e-3 : 1e-4) * expected)
              << g << " " << phi << " " << begin << " " << H;
        }
}

// Rationale: density, which the midpoint rule of a lamp takes from the column. Expectation: a plate between lamp and
// air leaves what is not behind it, within half a bin.
TEST(ScanPlanes, PlateBeforeALamp) {
  const V3f axis = direction(0, 0);
  auto settings = planes_to(axis, pi, 2048, 64);
  settings.lamp = 5;
  settings.nearest = 0.002f;
  ScanPlanes planes(settings);
  const V3f lamp = settings.eye + axis * 5;
  const auto plate = quad(lamp + V3f(-1, 0.5f, -1.2f), V3f(1.4f, 0, 0), V3f(0.3f, 0.2f, 2));
  // Along the ray the first: the least distance is the largest height.
  fill(planes, [&](const V3f& o, const V3f& towards) {
    double nearest = -INFINITY;
    for (const Triangle& t : plate) {
      const double h = highest_of({t}, o, towards);
      if (h < 0) nearest = std::max(nearest, h);
    }
    return nearest;
  });
  const AirLight light(planes, thin());
  int shaded = 0;
  for (int k = 0; k < planes.planes(); ++k)
    for (const double phi : {0.3, 0.9, 1.6, 2.3}) {
      const V3f d = in_plane(planes, k, phi);
      constexpr int steps = 20000;
      double expected = 0, clear = 0;
      for (int i = 0; i < steps; ++i) {
        const V3f P = settings.eye + d * (9 * (float(i) + 0.5f) / steps), w = P - lamp;
        const float r = length(w);
        const double h = highest_of(plate, lamp, w * (-1 / r)), part = 1 / double(r * r) / steps * 9;
        clear += part;
        if (!(h < 0 && -h < double(r))) expected += part;
      }
      shaded += expected < clear * 0.999;
      const double found = double(light.in_scattering({d, 0, 9, in_the_plane}).g) * 4 * M_PI;
      EXPECT_NEAR(found, expected, 0.004 * clear) << k << " " << phi;
    }
  EXPECT_GT(shaded, 20);
}

// Rationale: frames on film with the epipole in view, ahead, behind, beside and at infinity. Expectation: neighbouring
// planes at most a pixel apart anywhere, and no film outside the fan.
TEST(PlaneFan, HoldsTheFilm) {
  constexpr int w = 60, h = 40;
  const auto look = [&](double x, double y) {
    return normalize(V3f(float((x - w / 2.0) / 40), float((h / 2.0 - y) / 40), 1));
  };
  const auto spread = [&](const V3f& d) { return d.z / 40; };
  std::vector<FilmDirection> corners, inside;
  for (const double x : {0.0, double(w)})
    for (const double y : {0.0, double(h)}) corners.push_back({look(x, y), spread(look(x, y))});
  for (int y = 0; y <= h; y += 4)
    for (int x = 0; x <= w; x += 4) inside.push_back({look(x, y), spread(look(x, y))});
  for (const V3f& to_light : {V3f(0.1f, 0.05f, 1), V3f(0.2f, -0.1f, -1), V3f(1, 0.2f, 0), V3f(3, 1, 1), V3f(-2, 5, -1),
                              V3f(0, 1, 0), V3f(0.75f, 0.5f, 1)}) {
    auto settings = planes_to(normalize(to_light), 10);
    settings.fan = fit_planes(Frame(settings.axis), corners, inside, 1);
    const ScanPlanes planes(settings);
    EXPECT_LE(settings.fan.planes, 4 * (w + h)) << to_light;
    for (double y = 0.5; y < h; y += 3)
      for (double x = 0.5; x < w; x += 3) {
        const V3f d = look(x, y);
        for (const float xi : {0.0f, 0.5f, 0.999f}) {
          const int k = planes.plane_of(d, xi);
          ASSERT_TRUE(k >= 0 && k < planes.planes());
          // Off the plane by less than a pixel.
          const float off = std::abs(dot(d, cross(settings.axis, planes.across(k))));
          EXPECT_LE(off, spread(d) * 1.2f) << to_light << " " << x << " " << y << " " << k;
        }
      }
  }
}

// Rationale: half the light of a tinted ray of light. Expectation: half the light, channel by channel, exactly once.
TEST(ScanPlanes, TintsAndDarkness) {
  const V3f sun = direction(0.9, 0);
  auto settings = planes_to(sun, 60);
  const RGB clear = AirLight(ScanPlanes(settings), layered(5)).in_scattering({direction(0.1, 1), 0, 20});
  settings.tinted = true;
  ScanPlanes planes(settings);
  for (int k = 0; k < planes.planes(); ++k) {
    std::fill_n(planes.tint(k), planes.bins(), RGB(0.5f, 1, 0));
    planes.close(k);
  }
  const RGB tinted = AirLight(planes, layered(5)).in_scattering({direction(0.1, 1), 0, 20});
  EXPECT_NEAR(tinted.r, 0.5f * clear.r, 1e-5f * clear.r);
  EXPECT_NEAR(tinted.g, clear.g, 1e-5f * clear.g);
  EXPECT_EQ(tinted.b, 0);
  for (int k = 0; k < planes.planes(); ++k) {
    std::fill_n(planes.blocked(k), planes.bins(), infinity);
    planes.close(k);
  }
  EXPECT_TRUE(AirLight(planes, layered(5)).in_scattering({direction(0.1, 1), 0, 20}).is_black());
}

}  // namespace
}  // namespace dapple
