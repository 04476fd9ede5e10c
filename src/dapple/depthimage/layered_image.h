// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dapple/depthimage/fragment.h"

namespace dapple::depthimage {

/// The axes of an image: columns go along u, rows along v, which has z up where it can, and w points to who looks.
/// Orthonormal, right-handed.
struct ViewFrame {
  V3f u{1, 0, 0}, v{0, 1, 0}, w{0, 0, 1};

  ViewFrame() = default;
  explicit ViewFrame(const V3f& direction) : w(direction) {
    const bool upright = std::abs(w.z) < 0.999f;
    v = upright ? normalize(V3f(0, 0, 1) - w * w.z) : normalize(V3f(0, w.z, 0) - w * (w.y * w.z));
    u = cross(v, w);
  }
};

/// A layered depth image (Shade et al. 1998) of A-buffer fragments, by texel front to back.
struct LayeredImage {
  std::vector<uint32_t> first;  ///< by row and column: of its fragments; and the end of all
  std::vector<Fragment> fragments;
};

struct ImageLevel {
  int resolution = 0;  ///< texels a side, over the object's diameter
  std::vector<LayeredImage> views;
};

/// Largest values of a material's fragments.
struct ImageMaterial {
  RGB reflectance, transmittance;
};

/// The images of one object definition, in its own space (Max 1996: multilayer z-buffers of parts of trees).
///
/// Each level is sampled by itself, not averaged from finer ones: a sample is where a line through it meets a surface.
/// So cover stays right at every level without a model of how leaves hide each other, and normals stay unit vectors.
///
/// Where all layers are kept, an image holds what opposite viewers see, read forwards or backwards, and each facet is
/// in that image alone which sees it most squarely (the layered depth cube of Lischinski and Rappoport 1998): nothing
/// is there twice, and no fragment is stretched by more than the view directions' spread, sqrt(3) for six. Where layers
/// are limited, each image keeps what it sees first, on every line through a sample.
struct ObjectImages {
  static constexpr int largest_resolution = 2048, smallest_resolution = 8;  ///< of the finest level
  static constexpr int coarsest_resolution = 4;                             ///< of the last one
  static constexpr int most_views = 26, most_layers = 64, most_materials = 256, most_levels = 16;

  uint64_t key = 0;  ///< of what the images were made of
  std::string name;
  V3f centre{0, 0, 0};
  float radius = 0;             ///< images span centre +- radius along u, v and w
  Box3f box;                    ///< of the surfaces
  int layers = 0;               ///< kept on each line; 0: all
  std::vector<V3f> directions;  ///< unit, towards the viewers
  std::vector<ImageMaterial> materials;
  std::vector<ImageLevel> levels;  ///< the finest first, each of half the resolution of the one before

  float texel(const ImageLevel& level) const { return 2 * radius / float(level.resolution); }
  /// Where the samples of a fragment are, in the mean.
  V3f position(const ImageLevel& level, const ViewFrame& frame, int column, int row, const Fragment& f) const {
    const V2f c = SampleMask::centroid(f.mask);
    const float t = texel(level);
    return centre + frame.u * ((float(column) + c.x) * t - radius) + frame.v * ((float(row) + c.y) * t - radius) +
           frame.w * (radius - float(f.depth) * (2 * radius / 65535));
  }
  size_t fragment_count() const;
  size_t bytes() const;
};

/// Directions of so many views: 6 axes; 14: and the corners of a cube; 26: and the middles of its edges. With
/// `one_of_two`, of opposite ones only the first. Empty for other numbers.
std::vector<V3f> view_directions(int views, bool one_of_two);

}  // namespace dapple::depthimage
