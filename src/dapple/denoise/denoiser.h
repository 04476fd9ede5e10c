// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "dapple/denoise/pixel_rows.h"
#include "dapple/denoise/unet.h"
#include "dapple/image/image.h"

namespace dapple::denoise {

/// A linear picture without its noise, by a network for colour with or without albedo and normals.
class Denoiser {
 public:
  struct Options {
    int tile = 0;        ///< side of a tile without overlap, a multiple of 16; 0: chosen, for memory
    float exposure = 0;  ///< before the curve; 0: auto_exposure(), of which crops are better given the whole frame's
    StopToken stop{};
  };

  /// Weights of 3 channels (colour), 6 (and albedo) or 9 (and normals). Errors as read_tensors and UNet.
  explicit Denoiser(const std::string& weights);

  const UNet& network() const { return net_; }
  /// File name of the weights and the instruction set, for headers of images: one instruction set gives one image.
  std::string description() const;
  int inputs() const { return net_.inputs(); }
  /// All of one size; those that the network does not take may be null. What is not finite counts as 0, colour below 0
  /// as 0; black pictures stay black. Pictures of more than 2.1 million pixels are done by tiles whose overlap is what
  /// the network sees: beside the layers, 12 bytes a pixel and .6 GB are enough for pictures of any size. UsageError
  /// where sizes differ or a layer is missing. May throw Stopped.
  image::Image operator()(const PixelRows& colour, const PixelRows* albedo, const PixelRows* normal,
                          const Options& options) const;
  /// The same of images of three channels.
  image::Image operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal,
                          const Options& options) const;
  image::Image operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal) const {
    return (*this)(colour, albedo, normal, Options());
  }

 private:
  std::string weights_;
  UNet net_;
};

/// Scales `parts`, pixel by pixel and channel by channel, so that they add up to `whole`. Where none has light the
/// first gets what there is.
void add_up_to(const image::Image& whole, std::span<image::Image> parts);

}  // namespace dapple::denoise
