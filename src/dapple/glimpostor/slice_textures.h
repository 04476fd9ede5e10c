// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/depthimage/splat_object.h"
#include "dapple/glimpostor/gl_objects.h"

namespace dapple::glimpostor {

/// An image of a level as textures, a layer of the array for each fragment of a texel, front to back.
/// unshaded: reflectance and transmittance together in RGB, as shares of the level's largest; depth in alpha, 255 near,
/// 1 far, 0: nothing. normals: (n + 1) / 2 in object space, towards the
/// image's viewer, in RGB, the same alpha. numbers: the fragment, and its mask.
class SliceTextures {
 public:
  static constexpr int most_layers = 32;

  SliceTextures(const depthimage::SplatObject& object, const depthimage::SplatLevel& level, uint32_t view);

  void bind_unshaded(int unit) const { bind(unshaded_, unit); }
  void bind_normals(int unit) const { bind(normals_, unit); }
  void bind_numbers(int unit) const { bind(numbers_, unit); }
  int resolution() const { return resolution_; }
  int layers() const { return layers_; }
  float largest() const { return largest_; }
  size_t bytes() const { return bytes_; }

 private:
  static void bind(const Texture& texture, int unit);

  Texture unshaded_, normals_, numbers_;
  int resolution_ = 0, layers_ = 0;
  float largest_ = 0;
  size_t bytes_ = 0;
};

}  // namespace dapple::glimpostor
