// SPDX-License-Identifier: Apache-2.0
// Scenes that break caches of view-independent light.
#pragma once

#include <string>

namespace dapple::test {

// A room of one-quad walls with a thin partition lit on one side, a leaf, a mirror and a textured floor: what breaks radiosity caches.
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

// Two rooms, one lit, parted by a wall 1 mm thick, whose floor, ceiling, front and back are one quad each for both. `x`: of the camera.
inline std::string two_rooms(int x) {
  const std::string eye = std::to_string(x);
  return R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "box"
LookAt )" + eye + " 1.2 1.9  " + eye + R"( 1 0  0 1 0
Camera "perspective" "float fov" 70
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 40 40 40 ]
  Shape "bilinearmesh" "point3 P" [ -1.3 1.98 -.3  -.7 1.98 -.3  -1.3 1.98 .3  -.7 1.98 .3 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "bilinearmesh" "point3 P" [ -2 0 2  2 0 2  -2 0 -2  2 0 -2 ]
Shape "bilinearmesh" "point3 P" [ -2 2 -2  2 2 -2  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 0 -2  2 0 -2  -2 2 -2  2 2 -2 ]
Shape "bilinearmesh" "point3 P" [ 2 0 2  -2 0 2  2 2 2  -2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 0 2  -2 0 -2  -2 2 2  -2 2 -2 ]
Shape "bilinearmesh" "point3 P" [ 2 0 -2  2 0 2  2 2 -2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -.0005 0 2  -.0005 0 -2  -.0005 2 2  -.0005 2 -2 ]
Shape "bilinearmesh" "point3 P" [ .0005 0 -2  .0005 0 2  .0005 2 -2  .0005 2 2 ]
)";
}

}  // namespace dapple::test
