// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/base/hash.h"
#include "dapple/path/path_integrator.h"

namespace dapple::test {

/// A bush of square leaves about the origin of its object, 1 m in radius, with a stem.
inline std::string bush() {
  std::string text =
      "ObjectBegin \"bush\"\nMaterial \"diffusetransmission\" \"rgb reflectance\" [ .1 .3 .1 ] "
      "\"rgb transmittance\" [ .1 .2 .05 ]\n";
  KeyedRng rng(1);
  std::string points, indices;
  for (int i = 0; i < 400; ++i) {
    V3f c;
    do c = V3f(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    while (length(c) > 0.9f);
    const V3f n = normalize(V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f));
    V3f a, b;
    coordinate_system(n, &a, &b);
    for (const V3f& p : {c - a * 0.06f, c + b * 0.06f, c + a * 0.06f, c - b * 0.06f})
      points += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z + 1.2f) + " ";
    for (const int k : {0, 1, 2, 0, 2, 3}) indices += std::to_string(4 * i + k) + " ";
  }
  text += "Shape \"trianglemesh\" \"point3 P\" [ " + points + "] \"integer indices\" [ " + indices + "]\n";
  text +=
      "Material \"diffuse\" \"rgb reflectance\" [ .3 .2 .1 ]\n"
      "Shape \"cylinder\" \"float radius\" .06 \"float zmin\" 0 \"float zmax\" 1.2\nObjectEnd\n";
  return text;
}

/// A field of bushes on ground under sun and sky, from a distance; `camera` in place of the usual.
inline std::string bush_field(const std::string& camera = "", int columns = 5) {
  std::string text =
      camera.empty() ? "LookAt 0 -30 8  0 0 0.5  0 0 1 Camera \"perspective\" \"float fov\" 20\n" : camera;
  text += R"(Film "rgb" "integer xresolution" 96 "integer yresolution" 64 PixelFilter "box"
WorldBegin
LightSource "distant" "rgb L" [ 3 2.8 2.5 ] "point3 from" [ -.5 -.4 .8 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .3 .4 .5 ]
)" + bush();
  for (int i = 0; i < columns * columns; ++i)
    text += "AttributeBegin Translate " + std::to_string(2.2 * (i % columns) - 4.4) + " " +
            std::to_string(2.2 * (i / columns) - 4.4) + " 0 Rotate " + std::to_string(i * 40) +
            " 0 0 1 ObjectInstance \"bush\" AttributeEnd\n";
  return text +
         "Material \"diffuse\" \"rgb reflectance\" [ .2 .2 .2 ] Shape \"bilinearmesh\" \"point3 P\" [ -50 -50 0  50 "
         "-50 0  -50 50 0  50 50 0 ]\n";
}

inline path::PathIntegrator::Settings canopy_settings(const scene::Scene& scene) {
  path::PathIntegrator::Settings s;
  s.diffuse_bounces = 0;
  s.canopy_gather = false;
  vegetation::CanopyTransport::Settings canopy;
  canopy.gap_rays = 256;
  s.canopy = std::make_shared<vegetation::CanopyTransport>(scene, canopy);
  return s;
}

/// The bush alone.
inline std::string bush_scene() {
  return "Camera \"perspective\" WorldBegin\n" + bush() + "ObjectInstance \"bush\"";
}

}  // namespace dapple::test
