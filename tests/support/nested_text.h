// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/base/hash.h"

namespace dapple::test {

/// A small wood in the scene language: trees that hold branches that hold leaves, or the same flat, each thing placed
/// by itself. `leaf` is put before the leaves' shape: an alpha, say.
class NestedText {
 public:
  explicit NestedText(std::string leaf_parameters = "") : leaf_parameters_(std::move(leaf_parameters)) {
    KeyedRng rng(11);
    const auto places = [&rng](int count, float spread, float low, float high, float scale) {
      std::vector<std::string> out;
      for (int i = 0; i < count; ++i)
        out.push_back("Translate " + std::to_string(spread * (2 * rng.next() - 1)) + " " +
                      std::to_string(spread * (2 * rng.next() - 1)) + " " +
                      std::to_string(low + (high - low) * rng.next()) + " Rotate " + std::to_string(360 * rng.next()) +
                      " .3 .2 1 Scale " + std::to_string(scale * (0.8f + 0.4f * rng.next())) + " " +
                      std::to_string(scale) + " " + std::to_string(scale) + "\n");
      return out;
    };
    trees_ = places(9, 4, 0, 0, 1), branches_ = places(12, 0.6f, 1, 2.6f, 1),
    leaves_ = places(15, 0.3f, -0.3f, 0.3f, 1);
  }

  std::string nested() const {
    return "ObjectBegin \"leaf\"\n" + leaf() + "ObjectEnd\nObjectBegin \"branch\"\n" + branch() + all(leaves_, "leaf") +
           "ObjectEnd\nObjectBegin \"tree\"\n" + trunk() + all(branches_, "branch") + "ObjectEnd\n" +
           all(trees_, "tree");
  }
  std::string flat() const {
    std::string text = "ObjectBegin \"leaf\"\n" + leaf() + "ObjectEnd\nObjectBegin \"branch\"\n" + branch() +
                       "ObjectEnd\nObjectBegin \"trunk\"\n" + trunk() + "ObjectEnd\n";
    for (const std::string& t : trees_) {
      text += "AttributeBegin\n" + t + "ObjectInstance \"trunk\"\n";
      for (const std::string& b : branches_)
        text += "AttributeBegin\n" + b + "ObjectInstance \"branch\"\n" + all(leaves_, "leaf") + "AttributeEnd\n";
      text += "AttributeEnd\n";
    }
    return text;
  }
  size_t paths() const { return trees_.size() * (1 + branches_.size() * (1 + leaves_.size())); }

 private:
  static std::string all(const std::vector<std::string>& places, const std::string& object) {
    std::string text;
    for (const std::string& p : places)
      text += "AttributeBegin\n" + p + "ObjectInstance \"" + object + "\"\nAttributeEnd\n";
    return text;
  }
  std::string leaf() const {
    return "Material \"diffusetransmission\" \"rgb reflectance\" [ .1 .3 .1 ] \"rgb transmittance\" [ .1 .2 .05 ]\n"
           "Shape \"trianglemesh\" \"point3 P\" [ 0 -.07 0  .1 0 0  0 .07 0  -.1 0 0 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 "
           "] "
           "\"integer indices\" [ 0 1 2 0 2 3 ] " +
           leaf_parameters_ + "\n";
  }
  static std::string branch() {
    return "Material \"diffuse\" \"rgb reflectance\" [ .3 .2 .1 ]\nShape \"cylinder\" \"float radius\" .02 \"float "
           "zmin\" -.3 \"float zmax\" .3\n";
  }
  static std::string trunk() {
    return "Material \"diffuse\" \"rgb reflectance\" [ .3 .2 .1 ]\nShape \"cylinder\" \"float radius\" .1 \"float "
           "zmin\" 0 \"float zmax\" 2.6\n";
  }

  std::string leaf_parameters_;
  std::vector<std::string> trees_, branches_, leaves_;
};

/// The wood on ground, under sun and sky.
inline std::string wood_scene(const std::string& wood) {
  return R"(LookAt 0 -16 6  0 0 1.2  0 0 1 Camera "perspective" "float fov" 34
Film "rgb" "integer xresolution" 48 "integer yresolution" 32 PixelFilter "box"
WorldBegin
LightSource "distant" "rgb L" [ 3 2.8 2.5 ] "point3 from" [ -.5 -.4 .8 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .3 .4 .5 ]
)" + wood +
         "Material \"diffuse\" \"rgb reflectance\" [ .2 .2 .2 ] Shape \"bilinearmesh\" \"point3 P\" [ -30 -30 0  30 "
         "-30 0  -30 30 0  30 30 0 ]\n";
}

}  // namespace dapple::test
