// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/integrator.h"

namespace dapple::integrate {

/// Estimates before rendering how much less noise one of two integrators makes with the same camera samples, from small
/// boxes of pixels that are spread over the film. A pure function of film, integrators and `pixel_samples`; the same
/// for all crops.
class NoiseProbe {
 public:
  /// `film`: whole, whose filter and limits count.
  NoiseProbe(const scene::Film::Settings& film, int pixel_samples);

  /// The image is too small to spend enough samples on boxes.
  bool has_too_few_boxes() const { return int(boxes_.size()) < least_boxes; }

  struct Ratio {
    double value = 1;  ///< of variances; 1 where there is no noise
    double error = 0;  ///< its standard error, by leaving out one box at a time
  };
  /// Variance of samples by `other` as a part of that by `reference`: of sums over boxes, in each of which it is
  /// relative to the square of the light, as it is seen. `other` should be the less noisy one, which tells the light.
  /// Noise that all samples of `other` share, as that of a cache, is not seen. May throw Stopped.
  Ratio variance_ratio(const Integrator& other, const Integrator& reference, StopToken stop) const;

 private:
  static constexpr int least_boxes = 8, most_boxes = 64, box_side = 8;
  static constexpr uint32_t samples = 4;         // a pixel
  static constexpr int image_samples = 1 << 14;  // of the image, for each box: a sixty-fourth is tried

  /// Means over a box.
  struct Box {
    double variance = 0, light = 0;
  };
  std::vector<Box> look(const Integrator& integrator, StopToken stop) const;

  scene::Film::Settings film_;
  uint32_t pixel_samples_;
  std::vector<Box2i> boxes_;
};

}  // namespace dapple::integrate
