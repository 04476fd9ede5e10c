// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/denoise/unet.h"
#include "dapple/image/image.h"

namespace dapple::denoise {

/// A linear picture without its noise, by a network for colour with or without albedo and normals.
class Denoiser {
 public:
  struct Options {
    int tile = 1024;  ///< side of a tile without overlap; a multiple of 16
    StopToken stop{};
  };

  /// Weights of 3 channels (colour), 6 (and albedo) or 9 (and normals). Errors as read_tensors and UNet.
  explicit Denoiser(const std::string& weights);

  int inputs() const { return net_.inputs(); }
  /// All of one size with three channels; those that the network does not take may be null. What is not finite counts as 0, colour
  /// below 0 as 0. Frames larger than a tile are done by tiles whose overlap is what the network sees, so that memory stays
  /// bounded. UsageError where sizes differ or a layer is missing. May throw Stopped.
  image::Image operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal, const Options& options) const;
  image::Image operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal) const {
    return (*this)(colour, albedo, normal, Options());
  }

 private:
  UNet net_;
};

}  // namespace dapple::denoise
