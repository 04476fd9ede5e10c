// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "tests/support/render_text.h"

namespace dapple::test {

inline constexpr const char* forest_optics = R"("rgb reflectance" [ .05 .11 .45 ] "rgb transmittance" [ .04 .10 .45 ])";
inline constexpr const char* sun_and_sky =
    R"(LightSource "distant" "rgb L" [ 3 2.5 2 ] "point3 from" [ -.5265 -.3687 .766 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .25 .35 .5 ]
)";

/// Leaves over a ground, repeated without end.
struct Stand {
  std::string optics = forest_optics, lights = sun_and_sky, ground = "[ .2 .15 .1 ]";
  int clumps = 0;                                       ///< 0: leaves at random
  std::string camera = "LookAt 0 0 1  1 .4 .7  0 0 1";  ///< from inside
};

inline constexpr int leaf_count = 4500;
inline constexpr double leaf_radius = 0.06, half_width = 2, top = 2;  // of a cell: leaf area index 3.2

// Disks at random, normals uniform over directions, in a cell that is repeated without end.
inline std::string text_of(const Stand& stand) {
  std::string P, N;
  const auto random = [](uint64_t i, uint64_t k) { return double(to_unit_float(hash(i, k))); };
  for (uint64_t i = 0; i < leaf_count; ++i) {
    V3d p((2 * random(i, 0) - 1) * half_width, (2 * random(i, 1) - 1) * half_width, 0.1 + random(i, 2) * (top - 0.2));
    if (stand.clumps > 0) {  // in balls
      const uint64_t ball = 1000000 + i % uint64_t(stand.clumps);
      const double r = 0.45 * std::cbrt(random(i, 0)), z = 2 * random(i, 1) - 1,
                   phi = 2 * std::numbers::pi * random(i, 2), s = std::sqrt(1 - z * z);
      p = V3d((2 * random(ball, 0) - 1) * 1.5, (2 * random(ball, 1) - 1) * 1.5, 0.6 + random(ball, 2) * 0.8) +
          V3d(r * s * std::cos(phi), r * s * std::sin(phi), r * z);
    }
    const double mu = 2 * random(i, 3) - 1, phi = 2 * std::numbers::pi * random(i, 4), s = std::sqrt(1 - mu * mu);
    for (const double x : {p.x, p.y, p.z}) P += std::to_string(x) + " ";
    for (const double x : {s * std::cos(phi), s * std::sin(phi), mu}) N += std::to_string(x) + " ";
  }
  return "Film \"rgb\" \"integer xresolution\" 48 \"integer yresolution\" 48\n" + stand.camera +
         "\nCamera \"perspective\" \"float fov\" 90\nWorldBegin\n" + stand.lights +
         "Material \"diffuse\" \"rgb reflectance\" " + stand.ground +
         "\nShape \"bilinearmesh\" \"point3 P\" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]\nMaterial \"diffusetransmission\" " +
         stand.optics + "\nShape \"disks\" \"float radius\" " + std::to_string(leaf_radius) + " \"point3 P\" [ " + P +
         "] \"normal N\" [ " + N + "]\n";
}

inline build::BuiltScene built(const Stand& stand) {
  build::BuildOptions options;
  options.period = Imath::Box2d(Imath::V2d(-half_width), Imath::V2d(half_width));
  return build_text(text_of(stand), options);
}

}  // namespace dapple::test
