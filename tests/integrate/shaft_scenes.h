// SPDX-License-Identifier: Apache-2.0
#pragma once

// Boards in haze under suns and lamps, and what compares light shafts by scan planes with rays there.
#include <fmt/format.h>

#include "dapple/base/hash.h"
#include "dapple/light/shaft_builder.h"
#include "tests/support/render_text.h"

namespace dapple::shaft_scenes {

using light::ShaftLight;
using test::build_text;

struct Parts {
  std::string camera = "Camera \"perspective\" \"float fov\" 60\n";
  std::string medium = R"("string type" "exponential" "float scaleheight" 3)";
  std::string lights;
  std::string textures{};  ///< of the medium
  bool bounded = false;    ///< by a box, of which the camera is outside
};

/// Ground, and boards at random places above it, in haze.
inline std::string hazy_scene(const Parts& parts) {
  const std::string haze = "MakeNamedMedium \"haze\" " + parts.medium +
                           R"( "rgb sigma_a" [ .01 .01 .01 ] "rgb sigma_s" [ .08 .08 .1 ] "float g" .4 )";
  std::string text = parts.bounded ? "" : haze + "\n";  // before LookAt: height is that of the world
  text += "LookAt 0 -6 1.5  0 6 2.6  0 0 1\n";
  if (!parts.bounded) text += "MediumInterface \"\" \"haze\"\n";
  text += parts.camera + R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 24 PixelFilter "box"
WorldBegin
)";
  if (parts.bounded) text += parts.textures + haze;
  text += parts.lights + R"(
Material "diffuse" "rgb reflectance" [ .3 .3 .25 ]
Shape "bilinearmesh" "point3 P" [ -30 -30 0  30 -30 0  -30 30 0  30 30 0 ]
)";
  KeyedRng rng(8);
  for (int i = 0; i < 30; ++i) {
    const float x = rng.next() * 10 - 5, y = rng.next() * 12, z = 2.5f + 2.5f * rng.next();
    text += fmt::format("Shape \"bilinearmesh\" \"point3 P\" [ {0} {1} {2}  {3} {1} {4}  {0} {5} {2}  {3} {5} {4} ]\n",
                        x, y, z, x + 0.9f, z + 0.3f, y + 0.7f);
  }
  if (parts.bounded)
    text += R"(Material "interface" MediumInterface "haze" ""
Shape "trianglemesh" "integer indices" [ 0 2 1 1 2 3  4 5 6 5 7 6  0 1 4 1 5 4  2 6 3 3 6 7  0 4 2 2 4 6  1 3 5 3 7 5 ]
  "point3 P" [ -8 -2 -.5  8 -2 -.5  -8 14 -.5  8 14 -.5  -8 -2 6  8 -2 6  -8 14 6  8 14 6 ]
)";
  return text;
}

inline constexpr char sun[] =
    R"(LightSource "distant" "point3 from" [ -4 5 6 ] "point3 to" [ 0 0 0 ] "rgb L" [ 4 3.6 3 ] )";
inline constexpr char disc[] =
    R"(LightSource "sky" "float sunzenith" 45 "float sunazimuth" 100 "float sunirradiance" 4 "float sundiameter" 6 "float skyirradiance" 1 )";
inline constexpr char sky[] = R"(LightSource "infinite" "rgb L" [ .2 .3 .5 ] )";
inline constexpr char spot[] =
    R"(LightSource "spot" "point3 from" [ -3 2 8 ] "point3 to" [ 1.5 4 0 ] "rgb I" [ 60 55 40 ] "float coneangle" 30 "float conedeltaangle" 6 )";
inline constexpr char area[] = R"(AttributeBegin AreaLightSource "diffuse" "rgb L" [ 3 3 2 ]
Shape "sphere" "float radius" .5 AttributeEnd )";
inline constexpr char orthographic[] = "Camera \"orthographic\" \"float screenwindow\" [ -4 4 -3 3 ]\n";
inline constexpr char homogeneous[] = R"("string type" "homogeneous")";

// Clumps, and a bank of cloud over the ground.
inline std::string clumps() {
  std::string text = R"("string type" "uniformgrid" "point3 p0" [ -8 -2 -.5 ] "point3 p1" [ 8 14 6 ]
  "integer nx" 12 "integer ny" 12 "integer nz" 8 "float scale" 1.5 "float density" [)";
  KeyedRng rng(4);
  for (int i = 0; i < 12 * 12 * 8; ++i) text += fmt::format(" {:.2f}", std::max(3 * rng.next() - 1, 0.0f));
  return text + " ]";
}
inline constexpr char cloud[] =
    R"("string type" "cloud" "float density" 4 "point3 p0" [ -1 -.2 -1 ] "point3 p1" [ 1 1 1 ] "float frequency" 3)";
inline constexpr char wind[] = R"(Texture "wind" "float" "fbm" "integer octaves" 3
)";
inline constexpr char windy[] = R"("string type" "pattern" "point3 p0" [ -8 -2 -.5 ] "point3 p1" [ 8 14 6 ]
  "texture density" "wind" "float maxdensity" 2)";

inline std::shared_ptr<const ShaftLight> planes_of(const build::BuiltScene& built, light::ShaftSettings settings = {},
                                                   std::string* why = nullptr) {
  std::vector<std::string> left;
  std::string none;
  return light::make_shaft_light(*built.scene, settings, why ? why : &none, &left);
}

inline path::PathIntegrator::Settings paths(int scatterings) {
  path::PathIntegrator::Settings s;
  s.max_scatterings = s.diffuse_bounces = s.specular_depth = scatterings;
  return s;
}

// Z of a difference of means over blocks of 8 x 8 pixels, less a part of these means, the largest of all blocks and
// channels.
inline double worst_z(const scene::Film& a, const scene::Film& b, double relative) {
  double worst = 0;
  for (int y = 0; y < a.height(); y += 8)
    for (int x = 0; x < a.width(); x += 8)
      for (int c = 0; c < 3; ++c) {
        double difference = 0, variance = 0, sum = 0;
        for (int k = 0; k < 64; ++k) {
          const int i = x + k % 8, j = y + k / 8;
          difference += double(a.pixel(i, j)[c]) - double(b.pixel(i, j)[c]);
          variance += double(a.variance(i, j)[c]) + double(b.variance(i, j)[c]);
          sum += double(a.pixel(i, j)[c]);
        }
        worst = std::max(worst, (std::abs(difference) - relative * sum) / std::sqrt(variance));
      }
  return worst;
}

}  // namespace dapple::shaft_scenes
