// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "dapple/base/stop_token.h"
#include "dapple/denoise/tensor_file.h"

namespace dapple::denoise {

/// Open Image Denoise's U-Net: five levels of 3x3 convolutions with skips, zeros outside. Channel counts come from the
/// weights. Convolutions are oneDNN's direct ones (no Winograd), one-threaded on fixed boxes of pixels under
/// parallel_for, so that results do not depend on the number of threads. They do depend on the instruction set.
class UNet {
 public:
  /// InputError, naming `name`, where a layer is missing or does not fit the one before it.
  UNet(const TensorMap& tensors, const std::string& name);
  ~UNet();
  UNet(const UNet&) = delete;
  UNet& operator=(const UNet&) = delete;

  int inputs() const;  ///< channels of an image that enters
  int outputs() const;
  /// `in` is width * height * inputs(), row-major, channels interleaved; `out` likewise with outputs(). The sides are
  /// multiples of 16. May throw Stopped, within some milliseconds.
  void run(std::span<const float> in, int width, int height, std::span<float> out, StopToken stop = {}) const;

  // For benchmarks.
  double flops(int width, int height) const;         ///< floating-point operations of run()
  double bare_seconds(int width, int height) const;  ///< what run()'s convolutions take alone

 private:
  struct Layers;
  std::unique_ptr<Layers> layers_;
};

/// oneDNN's name of the instruction set in use, such as "avx2".
std::string instruction_set();

}  // namespace dapple::denoise
