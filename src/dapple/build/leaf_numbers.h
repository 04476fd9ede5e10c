// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace dapple::build {

/// Numbers of answers by a canopy's solution that nobody asked for (docs/design/044).
struct LeafNumbers {
  /// Standard deviation of the image by them, of its light.
  static constexpr float most_error = 0.01f;
  /// Of the paths, those that meet a leaf after a diffuse scattering: where fewer do, ends of them save little.
  static constexpr double least_answered = 0.125;
  /// Camera samples that take about as long as setting up.
  static constexpr double least_samples = 1 << 20;
  /// Materials that are counted apart: many take long to solve.
  static constexpr size_t most_materials = 128;
  /// Of the camera samples, how many paths look at leaves, and how many at most.
  static constexpr double looking = 1.0 / 64;
  static constexpr int most_looking = 1 << 16;
  /// Facets and instances that are counted (vegetation::SurveyEffort): what more would tell, the paths tell.
  static constexpr size_t most_facets = size_t(1) << 22, most_placed = size_t(1) << 18;
};

}  // namespace dapple::build
