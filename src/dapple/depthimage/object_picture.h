// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "dapple/depthimage/splat_tile.h"

namespace dapple::depthimage {

/// What a picture of images shows.
enum class Shown { color, normal, depth, layers, material };
inline constexpr std::string_view shown_names[] = {"color", "normal", "depth", "layers", "material"};

/// Row-major, top row first; colours are linear, premultiplied by alpha, which is cover.
struct ObjectPicture {
  int width = 0, height = 0;
  std::vector<RGB> color;
  std::vector<float> alpha;
};

/// The orthographic view of an object from a direction (unit, towards the viewer), z up where it can be: `pixels` on
/// the images' diameter.
ScreenMap orthographic_map(const SplatObject& object, const V3f& to_viewer, int pixels);

/// An object as its images show it in a camera, by one level: each sub-sample has what is nearest.
/// color: reflectance and transmittance together; normal: (n + 1) / 2, towards the viewer; depth: white near, black
/// far; material: by number. Not layers.
ObjectPicture project(const SplatObject& object, int level, const ScreenMap& camera, const V2i& resolution,
                      Shown shown);

/// An image as it is: a pixel for each texel. layer: that fragment of each texel alone, 0 the first; -1: what is seen
/// of all. layers: how many fragments a texel has, white for 16.
ObjectPicture show_image(const ObjectImages& images, size_t level, size_t view, int layer, Shown shown);

}  // namespace dapple::depthimage
