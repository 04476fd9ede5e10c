// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <span>
#include <utility>
#include <vector>

#include "dapple/distribution/grid_store.h"

namespace dapple::distribution {

/// Points of grids that this thread has to shade, unless another thread that wants them sooner takes them. Whatever
/// happens, other threads must not wait for them for ever.
class ClaimedPoints {
 public:
  struct Claim {
    GridStore::GridPtr grid;
    ShadingGrid::Parts points;
    bool taken;
  };

  ClaimedPoints() = default;
  ~ClaimedPoints() { publish(claims_.size()); }
  ClaimedPoints(const ClaimedPoints&) = delete;
  ClaimedPoints& operator=(const ClaimedPoints&) = delete;

  void add(const GridStore::GridPtr& grid, ShadingGrid::Parts points, bool taken = false) {
    claims_.push_back({grid, points, taken});
    count_ += std::popcount(points);
  }
  /// Takes those of a claim that no other thread has taken; the claim is for these alone from then on.
  ShadingGrid::Parts take(size_t i) {
    Claim& c = claims_[i];
    if (c.taken) return c.points;
    c.taken = true;
    count_ -= std::popcount(c.points);
    c.points = c.grid->take(c.points);
    count_ += std::popcount(c.points);
    return c.points;
  }
  int count() const { return count_; }  ///< of points
  std::span<const Claim> claims() const { return claims_; }
  /// Moves the last claims to another's, of so many points or a few less; one at least.
  void give(int points, ClaimedPoints* to) {
    const int least = count_ - points;
    do {
      to->claims_.push_back(std::move(claims_.back()));
      const int moved = std::popcount(to->claims_.back().points);
      claims_.pop_back();
      count_ -= moved, to->count_ += moved;
    } while (!claims_.empty() && count_ - std::popcount(claims_.back().points) >= least);
  }
  /// Takes out the first n.
  void publish(size_t n) {
    for (size_t i = 0; i < n; ++i) {
      claims_[i].grid->publish(claims_[i].points);
      count_ -= std::popcount(claims_[i].points);
    }
    claims_.erase(claims_.begin(), claims_.begin() + ptrdiff_t(n));
  }

 private:
  std::vector<Claim> claims_;
  int count_ = 0;
};

}  // namespace dapple::distribution
