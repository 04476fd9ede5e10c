// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/film.h"
#include "dapple/scene/scene.h"

namespace dapple::render {

/// While it lives, a scene's camera has fewer pixels of the same view.
class ReducedView {
 public:
  enum class Pixels : uint8_t {
    wide,    ///< each so many times as wide as those of the whole view
    sparse,  ///< some of the whole view's, with the same samples
  };
  /// `reduction` times fewer pixels a row and column. The film keeps `light_groups` groups (0: none), with the scene's
  /// gains.
  ReducedView(scene::Scene& scene, int reduction, int light_groups, Pixels pixels = Pixels::wide);
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
