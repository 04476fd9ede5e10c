// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/base/vec.h"

namespace dapple::shafts {

/// Half-planes around an axis through the eye: from azimuth `first` (radians) on, `step` apart. `closed`: they go all
/// the way round. The axis points to the light; what the picture shows of it, its epipole, may lie anywhere.
struct PlaneFan {
  float first = 0, step = 2 * pi;
  int planes = 1;
  bool closed = true;
};

/// What is seen through a place of the film.
struct FilmDirection {
  V3f d;             ///< unit
  float spread = 0;  ///< radians that a pixel covers
};

/// The fan whose neighbours are at most `spacing` pixels apart on all of the film. `corners`: of a film that shows a
/// convex cone of directions, in any order; empty where it shows all directions. `inside`: samples all over the film.
/// With an epipole outside the picture, planes beyond it are left out; with one inside the fan is closed.
PlaneFan fit_planes(const Frame& axis, std::span<const FilmDirection> corners, std::span<const FilmDirection> inside,
                    float spacing);

/// Azimuth of a direction around axis.n, in (-pi, pi].
float azimuth(const Frame& axis, const V3f& d);

}  // namespace dapple::shafts
