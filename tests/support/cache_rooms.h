// SPDX-License-Identifier: Apache-2.0
// Scenes that break caches of view-independent light.
#pragma once

#include <string>

#include "dapple/base/vec.h"

namespace dapple::test {

// A room of one-quad walls with a thin partition lit on one side, a leaf, a mirror and a textured floor: what breaks
// radiosity caches.
inline constexpr const char* room = R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 48
PixelFilter "box"
LookAt 0 -3.6 1.2  0 0 .9  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 14 13 11 ]
  Shape "bilinearmesh" "point3 P" [ -1.4 -.4 1.98  -1.4 .4 1.98  -.6 -.4 1.98  -.6 .4 1.98 ]
AttributeEnd
Texture "checks" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 6 "rgb tex1" [ .8 .7 .3 ] "rgb tex2" [ .1 .2 .4 ]
Material "diffuse" "texture reflectance" "checks"
Shape "trianglemesh" "point3 P" [ -2 -4 0  2 -4 0  2 2 0  -2 2 0 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ] "integer indices" [ 0 1 2  0 2 3 ]
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 2  2 -4 2  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  2 -4 0  -2 -4 2  2 -4 2 ]
Material "diffuse" "rgb reflectance" [ .7 .1 .1 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  -2 2 0  -2 -4 2  -2 2 2 ]
Material "diffuse" "rgb reflectance" [ .1 .6 .1 ]
Shape "bilinearmesh" "point3 P" [ 2 -4 0  2 2 0  2 -4 2  2 2 2 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ .2 -.5 0  .2 2 0  .2 -.5 1.4  .2 2 1.4 ]
Material "diffusetransmission" "rgb reflectance" [ .2 .3 .1 ] "rgb transmittance" [ .2 .4 .1 ]
Shape "disk" "float radius" .4 "float height" 1.2
Material "conductor" "rgb reflectance" [ .9 .8 .6 ] "float roughness" 0
Translate -1 .8 .4
Shape "sphere" "float radius" .4
)";

/// A bilinear patch as one quad, or as a mesh of n x n.
inline std::string wall(const V3f& a, const V3f& b, const V3f& c, const V3f& d, int n = 1) {
  std::string points, indices;
  const auto number = [](float x) { return std::to_string(x) + " "; };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const float u = float(i) / float(n), v = float(j) / float(n);
      const V3f p = (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v;
      points += number(p.x) + number(p.y) + number(p.z);
      const int k = j * (n + 1) + i;
      if (i < n && j < n)
        for (const int corner : {k, k + 1, k + n + 1, k + n + 2}) indices += std::to_string(corner) + " ";
    }
  return "Shape \"bilinearmesh\" \"point3 P\" [ " + points + "] \"integer indices\" [ " + indices + "]\n";
}

/// What stands between two rooms, 1 mm thick but for one_sheet, and how finely it is made of quads.
struct TwoRooms {
  bool one_sheet = false;  ///< one surface with two sides
  int planks = 1;          ///< of which the wall is put together, each a quad of its own
  int wall_quads = 1;      ///< along each side
  int room_quads = 1;      ///< along each side of floor, ceiling, and so on
  float length = 2;        ///< of each room; it is 4 wide and 2 high
  float lamp_height = 1.98f;
};

// Two rooms, one lit, whose floor, ceiling, front and back are one surface each for both. `x`: of the camera.
inline std::string two_rooms(int x, const TwoRooms& is = {}) {
  const std::string eye = std::to_string(x);
  std::string text = R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "box"
LookAt )" + eye + " 1.2 1.9  " +
                     eye + R"( 1 0  0 1 0
Camera "perspective" "float fov" 70
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 40 40 40 ]
  Translate 0 )" + std::to_string(is.lamp_height) +
                     R"( 0
  Shape "bilinearmesh" "point3 P" [ -1.3 0 -.3  -.7 0 -.3  -1.3 0 .3  -.7 0 .3 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
)";
  const int n = is.room_quads;
  const float x1 = is.length;
  text += wall({-x1, 0, 2}, {x1, 0, 2}, {-x1, 0, -2}, {x1, 0, -2}, n);
  text += wall({-x1, 2, -2}, {x1, 2, -2}, {-x1, 2, 2}, {x1, 2, 2}, n);
  text += wall({-x1, 0, -2}, {x1, 0, -2}, {-x1, 2, -2}, {x1, 2, -2}, n);
  text += wall({x1, 0, 2}, {-x1, 0, 2}, {x1, 2, 2}, {-x1, 2, 2}, n);
  text += wall({-x1, 0, 2}, {-x1, 0, -2}, {-x1, 2, 2}, {-x1, 2, -2}, n);
  text += wall({x1, 0, -2}, {x1, 0, 2}, {x1, 2, -2}, {x1, 2, 2}, n);
  const float half = is.one_sheet ? 0 : 0.0005f;
  for (int plank = 0; plank < is.planks; ++plank) {
    const float from = 2 - 4 * float(plank) / float(is.planks), to = 2 - 4 * float(plank + 1) / float(is.planks);
    text += wall({-half, 0, from}, {-half, 0, to}, {-half, 2, from}, {-half, 2, to}, is.wall_quads);
    if (!is.one_sheet) text += wall({half, 0, to}, {half, 0, from}, {half, 2, to}, {half, 2, from}, is.wall_quads);
  }
  return text;
}

}  // namespace dapple::test
