// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "dapple/scenefile/scene_description.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// Which copies of a thing reach into the cell of a scene that is repeated along x and y.
class Repetition {
 public:
  explicit Repetition(const Box2f& cell) : cell_(cell) {}

  /// The shape, of bounds `box` in the world, lies in the cell, or is level and covers it: then its copies would lie on
  /// it.
  bool needs_no_copies(const trace::Shape& shape, const Box3f& box) const;
  /// Calls add(world from object) for the place `at` of an object of bounds `box` and for its copies. InputError at
  /// `loc` if it is so large that there would be more than 10,000.
  void for_each_copy(const Box3f& box, const Transform& at, const FileLoc& loc,
                     const std::function<void(const Transform&)>& add) const;

 private:
  const Box2f cell_;
};

}  // namespace dapple::build
