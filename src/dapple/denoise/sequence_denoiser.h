// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <vector>

#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/temporal_blend.h"

namespace dapple::denoise {

/// Frames of a sequence without their noise, each by its neighbours too: the mean of noisy frames (TemporalBlend) goes
/// through the network, and of what comes out the mean is taken once more, as networks leave stains that differ from
/// frame to frame. So a frame depends on those up to twice as far as its neighbours.
///
/// Memory: the frames that are needed at a time, 4 with one neighbour each way, 52 bytes a pixel each (12 more with
/// motion, 24 with each light group), and 96 bytes a pixel beside what the network takes.
class SequenceDenoiser {
 public:
  using Load = std::function<SequenceFrame(size_t frame)>;
  struct Result {
    image::Image colour;
    std::vector<image::Image> light_groups;  ///< of which colour is the sum
    double share = 0;                        ///< mean share of the neighbours that counts, 0 to 1
  };

  /// `load` gives frames 0 to count - 1, each once. Frames up to `neighbours` before and after count, as far as their
  /// numbers say that they are so near: neighbours times `step`.
  SequenceDenoiser(const Denoiser& denoiser, size_t count, int neighbours, double step, Load load);

  /// Whether any frame counts beside this one.
  bool has_neighbours(size_t frame) { return !around(frame).empty(); }
  /// Of one frame after the other. A function of the frames around it alone. UsageError as Denoiser and TemporalBlend.
  Result operator()(size_t frame);
  /// In place of operator(), for a frame that has_neighbours() says none of and that is denoised otherwise.
  void skip(size_t frame);

 private:
  struct Part {
    image::Image colour;
    std::vector<image::Image> groups;
  };
  struct Means {
    std::vector<size_t> others;
    TemporalBlend blend;
  };
  const SequenceFrame& loaded(size_t i);
  const Part& denoised(size_t i);
  const Means& means(size_t i);
  std::vector<size_t> around(size_t i);

  const Denoiser& denoiser_;
  const size_t count_;
  const int neighbours_;
  const double step_;
  const Load load_;
  std::map<size_t, SequenceFrame> loaded_;
  std::map<size_t, Means> means_;
  std::map<size_t, Part> denoised_;
};

}  // namespace dapple::denoise
