// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "dapple/distribution/distribution_integrator.h"

namespace dapple::test {

/// Without the radiosity cache.
inline distribution::DistributionIntegrator::Settings uncached(int bounces, integrate::RayList shadow,
                                                               integrate::RayList diffuse) {
  distribution::DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = std::move(shadow);
  s.shading.diffuse_rays = std::move(diffuse);
  return s;
}

inline std::string film(int size) {
  const std::string n = std::to_string(size);
  return "Film \"rgb\" \"integer xresolution\" " + n + " \"integer yresolution\" " + n + "\nPixelFilter \"box\"\n";
}

/// Forty octaves of noise, ten times over: more work than a few rays.
inline std::string dear_material() {
  std::string text = "Texture \"t0\" \"float\" \"fbm\" \"integer octaves\" 40\n";
  for (int i = 1; i < 10; ++i) {
    const std::string n = std::to_string(i), last = std::to_string(i - 1);
    text += "Texture \"f" + n + "\" \"float\" \"fbm\" \"integer octaves\" 40 \"float roughness\" ." + n + "\n" +
            "Texture \"t" + n + "\" \"float\" \"mix\" \"texture tex1\" \"t" + last + "\" \"texture tex2\" \"f" + n +
            "\"\n";
  }
  return text +
         "Texture \"dear\" \"spectrum\" \"scale\" \"rgb tex\" [ .5 .5 .5 ] \"texture scale\" \"t9\"\n"
         "Material \"diffuse\" \"texture reflectance\" \"dear\"\n";
}

/// A room with a lamp, checks on its floor and two balls of `material`.
inline std::string furnished_room(const std::string& material) {
  return film(48) + R"(LookAt 0 -3.2 1.2  0 0 .8  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 12 11 9 ]
  Shape "bilinearmesh" "point3 P" [ -.4 -.4 1.98  -.4 .4 1.98  .4 -.4 1.98  .4 .4 1.98 ]
AttributeEnd
Texture "checks" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 6 "rgb tex1" [ .8 .7 .3 ] "rgb tex2" [ .1 .2 .4 ]
Material "diffuse" "texture reflectance" "checks"
Shape "trianglemesh" "point3 P" [ -2 -4 0  2 -4 0  2 2 0  -2 2 0 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ] "integer indices" [ 0 1 2  0 2 3 ]
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 2  2 -4 2  -2 2 2  2 2 2 ]
Material "diffuse" "rgb reflectance" [ .7 .1 .1 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  -2 2 0  -2 -4 2  -2 2 2 ]
Shape "bilinearmesh" "point3 P" [ 2 -4 0  2 2 0  2 -4 2  2 2 2 ]
)" + material +
         R"(
ObjectBegin "ball"
Shape "sphere" "float radius" .5
ObjectEnd
Translate -.7 .6 .5
ObjectInstance "ball"
Translate 1.4 0 0
Scale 1 1 .8
ObjectInstance "ball"
)";
}

}  // namespace dapple::test
