// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/denoise/frame_camera.h"
#include "dapple/image/image.h"

namespace dapple::denoise {

/// A frame of a sequence. Images are of one size, of three channels each, depth of one; all but `noisy` may be empty.
struct SequenceFrame {
  double number = 0;
  image::Image noisy, albedo, normal, depth;
  std::vector<image::Image> light_groups;  ///< noisy too
  float exposure = 0;                      ///< Denoiser::Options
  std::optional<FrameCamera> camera;
  image::Image motion;  ///< AOV motion: pixels and depth to the next frame
  /// Where the motion is not empty: the camera when the shutter closes, and how far it then is on its way to the next
  /// frame. None: the camera is still while the shutter is open.
  std::optional<FrameCamera> camera_at_close;
  float shutters_a_frame = 1;
  image::Image motion_back;                       ///< layer motion_back: the same to the previous frame; may be empty
  std::optional<FrameCamera> camera_of_previous;  ///< where that is not empty

  /// Whether its points can be found in other frames, and theirs in it.
  bool can_be_found() const { return camera && !albedo.empty() && !normal.empty() && !depth.empty(); }
};

/// Means of a frame and its neighbours, pixel by pixel, where these show the same point of the same surface in the same
/// light.
///
/// Points are found again by depth and the cameras of both frames, and by their motion where they move by themselves.
/// Of the four pixels around that place those count that have about the depth, the normal and the albedo that are
/// expected. Light is divided by albedo meanwhile, so that textures stay sharp. Where the mean light of small squares
/// differs by more than their noise, the light has moved, or a reflection: nothing is taken. What is hidden or beyond
/// the edge of a neighbour has no part in it. As in spatio-temporal filtering (Schied et al., "Spatiotemporal
/// Variance-Guided Filtering", 2017), but with frames of both sides, of which slow changes cancel.
class TemporalBlend {
 public:
  struct Neighbour {
    const SequenceFrame* frame;
    double frames = 1;  ///< from this frame to it; below 0 before it
    float weight = 1;   ///< beside this frame's 1
  };

  /// Frames must outlive this; they can_be_found(), if there are neighbours. UsageError where sizes differ.
  TemporalBlend(const SequenceFrame& at, std::span<const Neighbour> neighbours);

  /// Of images of three channels, this frame's and then those of its neighbours in their order.
  image::Image operator()(const image::Image& at, std::span<const image::Image* const> neighbours) const;
  /// Mean share of the neighbours' weights that counts.
  double share() const { return share_; }

 private:
  /// Pixels (x, y) to (x + 1, y + 1) of a neighbour, and what each counts.
  struct Taps {
    int x = 0, y = 0;
    float weight[4] = {};
  };
  using TapMap = std::vector<Taps>;

  TapMap find_again(const Neighbour& n) const;
  void check_light(const Neighbour& n, TapMap* taps) const;
  RGB gather(const Taps& t, const SequenceFrame& from, const image::Image& of) const;

  const SequenceFrame& at_;
  std::vector<Neighbour> neighbours_;
  std::vector<TapMap> taps_;
  double share_ = 0;
};

}  // namespace dapple::denoise
