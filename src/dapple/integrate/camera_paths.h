// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/integrator.h"
#include "dapple/integrate/light_sums.h"

namespace dapple::integrate {

/// Camera samples of a block, and what paths bring them. About 0.1 MB.
struct PathSamples {
  static constexpr int capacity = CameraBatch::capacity;

  /// `groups`: of lights, whose parts are kept apart.
  explicit PathSamples(int groups) : L(groups) {}

  CameraBatch camera;
  bool left[capacity];   ///< to others: what the ray met first is in `hits`, and nothing below speaks of it
  trace::HitBatch hits;  ///< by sample
  LightSums L;
  RGB direct[capacity];  ///< as Film::add's
  scene::Features features[capacity];
  scene::AirFeatures air[capacity];
};

/// An integrator that traces each camera sample as a path of its own, and can leave some of them to others.
class CameraPaths : public Integrator {
 public:
  /// Traces s.camera, but leaves samples whose rays first meet a geometry of which `others` is true. Features, parts
  /// and air as far as `film` wants them. Counts in the workspace, one of this object's. May throw Stopped.
  virtual void trace(const std::vector<uint8_t>& others, const scene::Film::Settings& film, const StopToken& stop,
                     PathSamples& s, Workspace& workspace) const = 0;
};

/// What paths do beside others: samples that these would have are black, features are none. To compare paths by
/// (NoiseProbe).
class PathsAlone final : public Integrator {
 public:
  /// `others` as for CameraPaths::trace; `seed`: of the samples of pixels. All must outlive this object.
  PathsAlone(const scene::Scene& scene, const CameraPaths& paths, const std::vector<uint8_t>& others, uint64_t seed)
      : scene_(scene), paths_(paths), others_(others), seed_(seed) {}

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const TileWork& work, Workspace& workspace, scene::Film& film) const override;

 private:
  const scene::Scene& scene_;
  const CameraPaths& paths_;
  const std::vector<uint8_t>& others_;
  const uint64_t seed_;
};

}  // namespace dapple::integrate
