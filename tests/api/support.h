// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dapple/dapple.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace dapple::test {

/// A room of everything that edits know.
inline const char* const room = R"(
LookAt 0 1 -5  0 1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 32 "integer yresolution" 24
Sampler "zsobol" "integer pixelsamples" 4
Integrator "distribution" "integer bounces" 2 "string preset" "draft" "bool denoise" false
WorldBegin
LightSource "point" "string name" "key" "rgb I" [20 20 20] "point3 from" [1 2.5 -2]
LightSource "distant" "rgb L" [1 1 2] "point3 from" [-1 3 -2] "point3 to" [0 0 0]
LightSource "infinite" "string name" "sky" "rgb L" [.2 .2 .3]
Texture "checks" "spectrum" "checkerboard" "float uscale" 4 "float vscale" 4 "rgb tex1" [.8 .8 .8] "rgb tex2" [.2 .2 .2]
MakeNamedMaterial "floor" "string type" "diffuse" "texture reflectance" "checks"
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [.7 .1 .1]
MakeNamedMaterial "gloss" "string type" "coateddiffuse" "rgb reflectance" [.2 .4 .7] "float roughness" .2
NamedMaterial "floor"
Shape "trianglemesh" "string name" "ground" "point3 P" [-4 0 -4  4 0 -4  4 0 4  -4 0 4] "integer indices" [0 2 1 0 3 2]
  "point2 uv" [0 0 1 0 1 1 0 1]
AttributeBegin
  NamedMaterial "red"
  Translate -1 .6 0
  Shape "sphere" "string name" "ball" "float radius" .6
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "string name" "lamp" "rgb L" [6 5 3]
  Translate 0 2.8 0
  Rotate 90 1 0 0
  Shape "disk" "string name" "lamp" "float radius" .4
AttributeEnd
ObjectBegin "block"
  NamedMaterial "gloss"
  Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  1 1 0  0 1 0  0 0 1  1 0 1  1 1 1  0 1 1]
    "integer indices" [0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  3 7 6 3 6 2  0 4 7 0 7 3  1 2 6 1 6 5]
ObjectEnd
AttributeBegin
  Translate .4 0 -.4
  Rotate 20 0 1 0
  ObjectInstance "block"
AttributeEnd
AttributeBegin
  Translate .6 1 -.2
  Scale .5 .5 .5
  ObjectInstance "block" "string name" "upper"
AttributeEnd
)";

/// The file of a shader of examples/plugins.
inline std::string plugin(const std::string& name) {
  return EXAMPLES_DIR "/lib" + name + ".so";
}

/// Bit for bit.
inline void expect_same(const Picture& a, const Picture& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (size_t l = 0; l < a.layers.size(); ++l) {
    ASSERT_EQ(a.layers[l].pixels.size(), b.layers[l].pixels.size());
    EXPECT_EQ(
        std::memcmp(a.layers[l].pixels.data(), b.layers[l].pixels.data(), a.layers[l].pixels.size() * sizeof(float)), 0)
        << "layer " << a.layers[l].name;
  }
}

inline bool same(const Picture& a, const Picture& b) {
  return a.picture().pixels == b.picture().pixels;
}

inline double mean(const Layer& layer) {
  double sum = 0;
  for (const float v : layer.pixels) sum += double(v);
  return sum / double(layer.pixels.size());
}

/// What a call throws.
template <class Call>
SceneError error_of(const Call& call) {
  try {
    call();
  } catch (const SceneError& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {SceneError::Kind::usage, ""};
}

/// The file that a scene writes.
inline std::string written(const Scene& scene) {
  const std::string path =
      testing::TempDir() + "/written-" + std::to_string(::getpid()) + "-" + std::to_string(uintptr_t(&scene)) + ".pbrt";
  scene.write(path);
  return path;
}

}  // namespace dapple::test
