// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/impostor/image_view.h"

namespace dapple::impostor {

/// What the sub-samples of some pixels see of images: depthimage::SampleMask::side squared a pixel, row-major.
struct SubSamples {
  static constexpr uint32_t none = ~0u;

  Box2i pixels{V2i(0, 0), V2i(0, 0)};  ///< of the film, [min, max)
  std::vector<uint32_t> draw;          ///< of ImageView::draws(), or none
  std::vector<uint32_t> fragment;      ///< of its level, as SplatObject::surface() takes it
  std::vector<float> depth;            ///< along the camera's axis, scene units

  /// Puts what pixels of `block`, a part of `pixels`, see into a tile that has them and is empty.
  void put_into(const ImageView& view, const Box2i& block, depthimage::SplatTile* tile) const;
  size_t width() const { return size_t(pixels.max.x - pixels.min.x) * depthimage::SampleMask::side; }
};

/// Projects images in place of depthimage::SplatTile: a port, filled by what knows a graphics device.
class ProjectionDevice {
 public:
  /// Of all calls so far.
  struct Counts {
    uint64_t draw_calls = 0, binds = 0;  ///< of textures
    uint64_t bytes = 0;                  ///< held on the device
    double seconds = 0;
  };

  virtual ~ProjectionDevice() = default;
  /// What images show in `pixels`; jitter and round as SplatTile::start() takes them. The same view at each call. From
  /// any thread; calls wait for each other.
  virtual void project(const ImageView& view, const Box2i& pixels, const V2f& jitter, uint32_t round,
                       SubSamples* out) = 0;
  virtual Counts counts() const = 0;
};

}  // namespace dapple::impostor
