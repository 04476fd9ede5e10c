// SPDX-License-Identifier: Apache-2.0
// Diffusion on flat bodies against a walk through them that knows of nothing else, by the direction of light and view.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/half_space.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

struct Body {
  double albedo, g, eta;
};
/// Zenith angles of view and sun, and the azimuth between them, 0 where the sun is behind the viewer; degrees.
struct Angles {
  double view, sun, azimuth = 0;
};

double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

double henyey_greenstein(double g, double cosine) {
  return (1 - g * g) / (4 * std::numbers::pi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

double scattering_cosine(double g, double u) {
  if (g == 0) return 1 - 2 * u;
  const double s = (1 - g * g) / (1 - g + 2 * g * u);
  return (1 + g * g - s * s) / (2 * g);
}

/// Inside, of a direction outside with this zenith angle: cosine and sine after refraction, and what the boundary lets
/// through.
struct Refracted {
  double cosine, sine, through;
  Refracted(double angle, double eta)
      : cosine(std::sqrt(1 - std::pow(std::sin(angle) / eta, 2))),
        sine(std::sin(angle) / eta),
        through(1 - fresnel_dielectric(std::cos(angle), eta)) {}
};

struct Estimate {
  double value = 0, error = 0;  ///< error: standard
};

/// Radiance of a half-space in a sun of irradiance 1 across its rays: photons walk, and each scattering sends towards
/// the viewer what escapes. z points down.
Estimate walked(const Body& body, const Angles& angles, int photons) {
  const Refracted out(radians(angles.view), body.eta), in(radians(angles.sun), body.eta);
  const V3d to_viewer(out.sine, 0, -out.cosine);
  KeyedRng rng(hash(uint64_t(angles.view), uint64_t(angles.sun), uint64_t(body.albedo * 1e4), uint64_t(body.g * 10)));
  const auto uniform = [&rng] { return double(rng.next()); };
  double sum = 0, squares = 0;
  for (int i = 0; i < photons; ++i) {
    V3d d(-in.sine * std::cos(radians(angles.azimuth)), -in.sine * std::sin(radians(angles.azimuth)), in.cosine);
    double z = 0, weight = in.through, seen = 0;
    while (weight > 0) {
      const double t = -std::log1p(-uniform());
      if (d.z < 0 && z + t * d.z <= 0) {
        weight *= fresnel_dielectric(-d.z, 1 / body.eta);
        z = 0, d.z = -d.z;
        if (weight < 0.05) weight = uniform() < weight / 0.1 ? 0.1 : 0;
        continue;
      }
      z += t * d.z;
      weight *= body.albedo;
      seen += weight * henyey_greenstein(body.g, d.dot(to_viewer)) * std::exp(-z / out.cosine);
      const double cosine = scattering_cosine(body.g, uniform()), sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
      const double phi = 2 * std::numbers::pi * uniform();
      const V3d a = (std::abs(d.z) < 0.9 ? V3d(-d.y, d.x, 0) : V3d(0, -d.z, d.y)).normalized(), b = d.cross(a);
      d = (d * cosine + (a * std::cos(phi) + b * std::sin(phi)) * sine).normalized();
      if (weight < 0.05) weight = uniform() < weight / 0.1 ? 0.1 : 0;
    }
    sum += seen, squares += seen * seen;
  }
  const double mean = sum / photons,
               scale = out.through / (out.cosine * body.eta * body.eta) * std::cos(radians(angles.sun));
  return {mean * scale, std::sqrt((squares / photons - mean * mean) / photons) * scale};
}

/// Radiance that diffusion gives a slab of 500 free paths, seen from `view`; `light`: of the scene.
double diffused(const Body& body, double view, const std::string& light) {
  const auto number = [](double v) { return std::to_string(v); };
  const double x = std::sin(radians(view)), z = std::cos(radians(view)), sigma = 1000;
  const std::string s = number(sigma * body.albedo), a = number(sigma * (1 - body.albedo));
  const std::string text =
      "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nPixelFilter \"box\"\nLookAt " +
      number(.5 * x) + " 0 " + number(.5 * z) +
      "  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -.05 .05 -.05 .05 ]\n"
      "WorldBegin\n" +
      light + "\nMaterial \"subsurface\" \"float eta\" " + number(body.eta) + " \"float g\" " + number(body.g) +
      " \"rgb sigma_s\" [ " + s + " " + s + " " + s + " ] \"rgb sigma_a\" [ " + a + " " + a + " " + a + R"( ]
Shape "trianglemesh" "point3 P" [ -1 -1 -.5  1 -1 -.5  1 1 -.5  -1 1 -.5  -1 -1 0  1 -1 0  1 1 0  -1 1 0 ]
  "integer indices" [ 4 5 6 4 6 7  0 2 1 0 3 2  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ])";
  distribution::DistributionIntegrator::Settings s2;
  s2.shading.bounces = 0;
  s2.shading.shadow_rays = integrate::RayList{16};
  s2.shading.subsurface_rays = 128;
  return double(test::render_text(text, 4, s2).mean().g);
}

std::string sun(const Angles& a) {
  const double x = std::sin(radians(a.sun)) * std::cos(radians(a.azimuth)),
               y = std::sin(radians(a.sun)) * std::sin(radians(a.azimuth));
  return "LightSource \"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ " + std::to_string(x) + " " +
         std::to_string(y) + " " + std::to_string(std::cos(radians(a.sun))) + " ] \"point3 to\" [ 0 0 0 ]";
}

/// By how much diffusion is off the walk in the sun, with the walk's standard error.
Estimate deviation(const Body& body, const Angles& angles) {
  const Estimate right = walked(body, angles, 40000);
  return {diffused(body, angles.view, sun(angles)) / right.value - 1, right.error / right.value};
}

// Seen from above, in a sun at 0, 45 and 75 degrees. Bounds: 1 % where light is scattered alike to all sides. With an
// asymmetry of .7 the product of entry and exit is off by up to 1.7 % where half of the light is absorbed and 2.8 %
// where nine tenths are (by discrete ordinates). Three standard errors of the walk (.3 to .5 %) are added. Similarity,
// in place of transport with the asymmetry, is 10 to 18 % off in the last.
TEST(SubsurfaceSlab, IsTheWalkInSun) {
  const struct {
    Body body;
    double bound;
  } table[] = {{{0.9, 0, 1.33}, 0.01}, {{0.99, 0, 1.5}, 0.01}, {{0.99, 0.7, 1.33}, 0.017}, {{0.9, 0.7, 1.33}, 0.028}};
  for (const auto& [body, bound] : table)
    for (const double angle : {0.0, 45.0, 75.0}) {
      const Estimate off = deviation(body, {0, angle});
      EXPECT_NEAR(off.value, 0, bound + 3 * off.error)
          << "albedo " << body.albedo << ", g " << body.g << ", sun " << angle;
    }
}

// In an even sky the radiance is the reflectance by direction, of any asymmetry and absorption. Bound: 1 %.
TEST(SubsurfaceSlab, IsTheHalfSpaceInSky) {
  for (const Body& body : {Body{0.9, 0, 1}, {0.9, 0, 1.33}, {0.9, 0.7, 1.33}, {0.6, 0.7, 1.33}, {0.999, 0.7, 1.5}})
    for (const double view : {0.0, 60.0}) {
      const HalfSpaceLight light = half_space_light(body.albedo, body.eta, body.g);
      const Refracted out(radians(view), body.eta);
      const double scattered = light.reflectance * (1 - fresnel_diffuse(body.eta)) * out.through,
                   right = 1 - out.through + scattered * escape_shape(light.escape, out.cosine);
      EXPECT_NEAR(diffused(body, view, "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]"), right, 0.01 * right)
          << "albedo " << body.albedo << ", g " << body.g << ", index " << body.eta << ", view " << view;
    }
}

// The known limits of docs/guide/materials.md: light that is scattered once keeps to its direction, which a product of
// entry and exit does not know. Without a boundary that bends light to the normal, seen and lit from above and at
// glancing angles; with an asymmetry, at glancing angles from the sun's side and against the sun. Who mends them finds
// it here. Bound: 2 %, the walk's noise in it.
TEST(SubsurfaceSlab, LightScatteredOnceIsALimit) {
  EXPECT_NEAR(deviation({0.9, 0, 1}, {0, 0}).value, -0.065, 0.02);
  EXPECT_NEAR(deviation({0.9, 0, 1}, {75, 75}).value, -0.14, 0.02);
  EXPECT_NEAR(deviation({0.99, 0.7, 1.33}, {60, 75, 0}).value, 0.08, 0.02);
  EXPECT_NEAR(deviation({0.99, 0.7, 1.33}, {60, 75, 180}).value, -0.105, 0.02);
}

}  // namespace
}  // namespace dapple
