// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

namespace dapple::integrate {

/// Numbers of rays a shading point sends, by diffuse depth (0 = visible surfaces); the last is repeated. Never empty.
class RayList {
 public:
  RayList(std::initializer_list<int> counts) : counts_(counts) {}
  explicit RayList(std::vector<int> counts) : counts_(std::move(counts)) {}
  int at(int depth) const { return counts_[std::min(size_t(depth), counts_.size() - 1)]; }
  /// Where so many points do the work of one between them: their part, rounded up.
  int at(int depth, int share) const { return part(at(depth), share); }
  /// The same of a point that sends the rays of `effort` points, but no more than `most_by_effort` unless the list says
  /// so.
  int at(int depth, int share, int effort) const {
    const int rays = at(depth);
    return part(std::max(rays, std::min(rays * effort, most_by_effort)), share);
  }
  static constexpr int most_by_effort = 64;
  static int part(int rays, int share) { return (rays + share - 1) / share; }

 private:
  std::vector<int> counts_;
};

}  // namespace dapple::integrate
