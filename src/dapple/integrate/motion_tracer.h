// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "dapple/integrate/feature_tracer.h"
#include "dapple/trace/shape_matches.h"

namespace dapple::integrate {

/// The scene of the frame after this one, or of that before it, where its shutter opens. The scene outlives it.
struct NeighbourScene {
  const scene::Scene& scene;
  int frames;                ///< 1: the next frame's, -1: that before
  V3d shift;                 ///< what its coordinates are more than those of this frame's scene
  trace::ShapeMatches same;  ///< of this frame's scene
};

/// How what each pixel shows moves on the film: by its own motion and by the camera's. Both are known while the shutter
/// is open, and are taken to go on as far as the next frame (scene::Camera::shutters_a_frame).
///
/// Of perspective cameras with thin lenses the pinhole in the lens's middle counts, of lens systems that with the same
/// field of view.
class MotionTracer {
 public:
  using Settings = FeatureTracer::Settings;

  MotionTracer(const scene::Scene& scene, const Settings& settings)
      : scene_(scene), settings_(settings), materials_(scene), tracer_(scene, materials_, false) {}

  /// Whether the scene's camera has a film on which points have one place: perspective and orthographic ones.
  static bool can_trace(const scene::Scene& scene);
  /// By pixel of [min, max), row-major: x to the right and y down, pixels from this frame to the next; z, growth of
  /// depth, in scene units. Means over the camera samples that met a surface; where none did, of the sky, which is at
  /// rest. The same for any number of threads. 0 without can_trace(). May throw Stopped.
  std::vector<V3f> trace(const Box2i& pixels, StopToken stop = {}) const { return trace(pixels, nullptr, stop); }
  /// The same to a neighbouring frame, next or previous, whose scene tells it exactly: points go where the same shape
  /// has them there. Of what has no match there, the motion while the shutter is open goes on, forwards or backwards,
  /// seen by the neighbour's camera. 0 without can_trace() of both scenes.
  std::vector<V3f> trace(const Box2i& pixels, const NeighbourScene& to, StopToken stop = {}) const {
    return trace(pixels, &to, stop);
  }

 private:
  struct Workspace;
  std::vector<V3f> trace(const Box2i& pixels, const NeighbourScene* to, StopToken stop) const;
  void trace_block(const Box2i& block, Workspace& w) const;
  void add_hit(int p, Workspace& w) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const MaterialTable materials_;
  const RayTracer tracer_;
};

}  // namespace dapple::integrate
