// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/learning_points.h"

namespace dapple::path {

std::vector<light::LightPoint> LearningPoints::thinned() const {
  size_t all = 0;
  for (const Batch& batch : batches_) all += batch.points_.size();
  const size_t every = all / most_points + 1;
  std::vector<light::LightPoint> points;
  size_t number = 0;
  for (const Batch& batch : batches_)
    for (const light::LightPoint& point : batch.points_)
      if (number++ % every == 0) points.push_back(point);
  return points;
}

}  // namespace dapple::path
