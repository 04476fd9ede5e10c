// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/film.h"
#include "dapple/scene/scene.h"

namespace dapple::render {

/// While it lives, a scene's camera has fewer pixels of the same view.
class ReducedView {
 public:
  /// What a sample of a pixel stands for: all of the pixel, or what it would stand for in the whole view.
  enum class Footprints : uint8_t { of_pixels, of_whole_view };
  /// Pixels so many times as wide. The film keeps `light_groups` groups (0: none), with the scene's gains.
  ReducedView(scene::Scene& scene, int reduction, int light_groups, Footprints footprints = Footprints::of_pixels);
  ~ReducedView();
  ReducedView(const ReducedView&) = delete;
  ReducedView& operator=(const ReducedView&) = delete;

  scene::Film& film() { return film_; }

 private:
  scene::Scene& scene_;
  const scene::Camera camera_;
  scene::Film film_;
};

}  // namespace dapple::render
