// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// Rays of each kind an integrator traced.
struct RayCounts {
  uint64_t camera = 0, shadow = 0, diffuse = 0, specular = 0, subsurface = 0;
  RayCounts& operator+=(const RayCounts& o) {
    camera += o.camera, shadow += o.shadow, diffuse += o.diffuse, specular += o.specular, subsurface += o.subsurface;
    return *this;
  }
  uint64_t total() const { return camera + shadow + diffuse + specular + subsurface; }
};

/// A tile's worth of work: camera samples [first_sample, first_sample + sample_count) of the pixels in `pixels`.
struct TileWork {
  Box2i pixels;  ///< [min, max)
  uint32_t first_sample = 0, sample_count = 1;
};

/// Computes camera samples. One object serves all threads; what changes lives in a Workspace, one a thread at a time.
class Integrator {
 public:
  class Workspace {
   public:
    virtual ~Workspace() = default;
    RayCounts rays;
    uint64_t shading_points = 0;
  };

  virtual ~Integrator() = default;
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  /// Adds the samples of `work` to the film. Only pixels of the tile are touched. A pure function of scene, settings and work.
  virtual void render(const TileWork& work, Workspace& workspace, scene::Film& film) const = 0;
};

}  // namespace dapple::integrate
