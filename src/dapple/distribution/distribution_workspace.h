// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <span>
#include <vector>

#include "dapple/distribution/distribution_integrator.h"
#include "dapple/distribution/pixel_points.h"
#include "dapple/integrate/camera_batch.h"

namespace dapple::distribution {

/// What serves a camera sample: nothing that is to be shaded, points of a grid, or its own hit.
enum class Source : uint8_t { nothing, grid, hit };

constexpr int sample_level = 0;  ///< of camera samples in the recursion, and of grids

/// A camera sample whose ray has met something.
struct CameraSample {
  V2i pixel;
  float film_weight;
  uint32_t seed, index;  ///< CameraBatch
  float time, spread;    ///< of its ray
  float width;           ///< of the pixel's footprint where it met something, m
  V3f d;
  RGB passed;
  int32_t medium;
  uint32_t geometry;
  geom::SurfacePoint surface;

  Source source = Source::nothing;
  bool refined;  ///< its grid is finer than its pixel asks for
  uint32_t held;
  ShadingGrid* grid;  ///< DistributionWorkspace::held
  scene::GridPoint point;
  scene::PatchTable::Neighbours near;  ///< on the grid
  ShadingGrid::Parts wanted;           ///< of the grid

  bool is_ready() const { return source == Source::nothing || (source == Source::grid && grid->has(wanted)); }
};

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

/// Camera samples that wait for shading points, or to be shaded in a batch with others. A pixel's samples leave in the
/// order in which they came, whatever the threads do: the film adds them up in that order.
struct WaitingSamples {
  static constexpr size_t most = 32 * integrate::CameraBatch::capacity;

  struct Waiting {
    CameraSample sample;
    GridStore::GridPtr grid;
    RGB L;
    std::vector<RGB> parts;  ///< of L
    bool done = false;
  };
  std::vector<Waiting> samples;
  int hits = 0;  ///< of them: Source::hit

  bool has_of(const V2i& pixel) const {
    return blocked_[slot(pixel)];
  }  ///< or of some other pixel: then a sample waits that need not
  void block(const V2i& pixel) { blocked_[slot(pixel)] = true; }
  void unblock_all() { std::fill_n(blocked_, slot_count, false); }

 private:
  static constexpr int side = 64, slot_count = side * side;
  static int slot(const V2i& pixel) { return pixel.y % side * side + pixel.x % side; }
  bool blocked_[slot_count] = {};
};

/// What a thread needs for distribution ray tracing.
struct DistributionWorkspace final : integrate::Integrator::Workspace {
  static constexpr int capacity = integrate::CameraBatch::capacity;

  explicit DistributionWorkspace(int groups = 0) : shading(groups), L(groups), waiting_L(groups) {}

  PixelSets sets{1, 0};  ///< of the work at hand
  integrate::CameraBatch camera;
  ShadingWorkspace shading;
  std::unique_ptr<IrradianceInterpolator::Workspace> interpolation;

  // By camera sample under way.
  trace::RayBatch camera_rays;
  trace::HitBatch hits;
  integrate::RayTracer::Flights flights;
  float distance[capacity];
  int32_t medium[capacity];
  RGB passed[capacity];
  integrate::LightSums L;
  CameraSample sample[capacity];

  std::vector<GridStore::GridPtr> held;  ///< grids that samples of a block see, so that the store may drop them
  static constexpr int found_count = 512;
  uint32_t found[found_count];  ///< index in `held` + 1 by the names of grids; 0: none
  int order[capacity];
  ClaimedPoints claimed;
  WaitingSamples waiting;
  integrate::LightSums waiting_L;
  trace::RayBatch seen_ray;
  trace::HitBatch seen_hits;

  PixelPoints seen;
  bool seen_known = false;

  // Where the points of the batch under way belong.
  struct Target {
    ShadingGrid* grid;
    int index;
  } target[integrate::PointBatch::capacity];

  // Samples that are about to be finished, and where their light is.
  int finished = 0;
  const CameraSample* finishing[capacity];
  int finishing_L[capacity];
  scene::Features features[capacity];
};

}  // namespace dapple::distribution
