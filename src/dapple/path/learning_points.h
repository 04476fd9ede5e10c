// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/light/light_learning.h"

namespace dapple::path {

/// The points at which paths traced before rendering want light: what is learned from (docs/design/029).
class LearningPoints {
 public:
  class Batch {
   public:
    void note(const light::LightPoint& point) {
      if (points_.size() < most_points_of_batch) points_.push_back(point);
    }

   private:
    friend LearningPoints;
    std::vector<light::LightPoint> points_;
  };

  explicit LearningPoints(size_t batches) : batches_(batches) {}

  size_t batches() const { return batches_.size(); }
  /// Of a thread at a time.
  Batch* of_batch(size_t i) { return &batches_[i]; }
  /// In the order of batches: every n-th of them, so that they are no more than most_points.
  std::vector<light::LightPoint> thinned() const;

 private:
  /// Limits of memory and time; a batch of paths has thousands in a cloud, where they scatter without end.
  static constexpr size_t most_points = size_t(1) << 17, most_points_of_batch = 8192;

  std::vector<Batch> batches_;
};

}  // namespace dapple::path
