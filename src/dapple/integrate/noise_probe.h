// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/integrator.h"

namespace dapple::integrate {

/// Estimates before rendering how much less noise one of two integrators makes with the same camera samples, from small
/// boxes of pixels that are spread over the film. A pure function of scene, integrators and `pixel_samples`.
class NoiseProbe {
 public:
  /// For a film on which so many samples are taken a pixel.
  NoiseProbe(const V2i& film, int pixel_samples);

  /// Fewer samples, in all boxes, than would say much: of small images, of which they would be too large a part.
  bool knows_little() const { return int(boxes_.size()) < least_boxes; }
  /// Variance of samples by `other` as a part of that by `reference`, geometric mean over boxes; 1 where there is no
  /// noise. Noise that all samples of `other` share, as that of a cache, is not seen. May throw Stopped.
  double variance_ratio(const Integrator& other, const Integrator& reference, StopToken stop) const;

 private:
  static constexpr int least_boxes = 8, most_boxes = 64, box_side = 8;
  static constexpr uint32_t samples = 4;         // a pixel
  static constexpr int image_samples = 1 << 14;  // of the image, for each box: a sixty-fourth is tried

  std::vector<double> variances(const Integrator& integrator, StopToken stop) const;

  V2i film_;
  uint32_t pixel_samples_;
  std::vector<Box2i> boxes_;
};

}  // namespace dapple::integrate
