// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/stop_token.h"
#include "dapple/numeric/sobol.h"
#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// Rays of each kind an integrator traced. `link`: between shading points, to see which belong together.
struct RayCounts {
  uint64_t camera = 0, shadow = 0, diffuse = 0, specular = 0, subsurface = 0, link = 0;
  uint64_t mask = 0;  ///< shadow rays that were looked up in masks and not traced
  RayCounts& operator+=(const RayCounts& o) {
    camera += o.camera, shadow += o.shadow, diffuse += o.diffuse, specular += o.specular, subsurface += o.subsurface;
    link += o.link, mask += o.mask;
    return *this;
  }
  /// Of those that were traced.
  uint64_t total() const { return camera + shadow + diffuse + specular + subsurface + link; }
};

/// Points at which each stage of the shaders ran.
struct StageCounts {
  std::array<uint64_t, shading::stage_count> points{};
  uint64_t batches = 0;        ///< of prelighting, each of one material
  double shading_seconds = 0;  ///< in the shaders, of all threads
  double tracing_seconds = 0;  ///< in rays, of all threads
  uint64_t& operator[](shading::Stage s) { return points[size_t(s)]; }
  uint64_t operator[](shading::Stage s) const { return points[size_t(s)]; }
  StageCounts& operator+=(const StageCounts& o) {
    for (size_t s = 0; s < points.size(); ++s) points[s] += o.points[s];
    batches += o.batches;
    shading_seconds += o.shading_seconds;
    tracing_seconds += o.tracing_seconds;
    return *this;
  }
};

/// Resolutions of the caches of view-independent results.
enum class Resolution : uint8_t { coarse, medium, fine };
inline constexpr int resolution_count = 3;
inline constexpr std::array<std::string_view, resolution_count> resolution_names{"coarse", "medium", "fine"};

/// What became of look-ups in one cache at one resolution.
struct CacheCounts {
  uint64_t lookups = 0, hits = 0, fills = 0;
  double fill_seconds = 0;  ///< of all threads; docs/guide/statistics.md says what is included
  // Of look-ups that have no memory of their own (CacheState::has_memory):
  uint64_t evictions = 0;
  int64_t bytes = 0;        ///< of entries that came, less those that went
  uint64_t extensions = 0;  ///< hits that had to add something to what was there
  CacheCounts& operator+=(const CacheCounts& o) {
    lookups += o.lookups, hits += o.hits, fills += o.fills, fill_seconds += o.fill_seconds;
    evictions += o.evictions, bytes += o.bytes, extensions += o.extensions;
    return *this;
  }
};

/// A cache at one resolution, or the look-ups at one diffuse depth, which have no memory of their own: evictions and
/// bytes are among their counts.
struct CacheState {
  std::string name;  ///< "radiosity.fine", "radiosity.depth1"
  CacheCounts counts{};
  uint64_t evictions = 0, bytes = 0, peak_bytes = 0, capacity_bytes = 0;
  bool has_memory = true;
};

/// Light shafts by scan planes: camera rays that were looked up, for each light.
struct ShaftCounts {
  uint64_t queries = 0;
  double query_seconds = 0;  ///< of all threads, from one query in 32
  ShaftCounts& operator+=(const ShaftCounts& o) {
    queries += o.queries, query_seconds += o.query_seconds;
    return *this;
  }
};

/// The tables of these planes; no lights: there are none.
struct ShaftTables {
  int lights = 0, planes = 0, bins = 0;  ///< bins: of a plane, at most
  uint64_t rays = 0;                     ///< of light, that filled them
  size_t bytes = 0, capacity_bytes = 0;
  double fill_seconds = 0;
};

/// Work for a thread: camera samples [first_sample, first_sample + sample_count) of the pixels in `pixels`.
struct TileWork {
  Box2i pixels;  ///< [min, max)
  uint32_t first_sample = 0, sample_count = 1;
  uint32_t pixel_samples =
      PixelSets::most_samples;  ///< that the picture will have, at most, if that is known: pixels share sets of so many
  StopToken
      stop{};  ///< render() and the next finish() may throw Stopped; the film holds nothing half done, and so do caches
};

/// Computes camera samples. One object serves all threads; what changes lives in a Workspace, one a thread at a time.
class Integrator {
 public:
  class Workspace {
   public:
    virtual ~Workspace() = default;
    RayCounts rays;
    StageCounts stages;
    ShaftCounts shafts;
    std::vector<CacheCounts> caches;  ///< in the order of Integrator::caches()
  };

  virtual ~Integrator() = default;
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  /// Adds the samples of `work` to the film, those of a pixel in their order; some may be put off until finish(), and
  /// are kept by the workspace. A pure function of scene, settings and work. Tiles that were rendered since the last
  /// finish() must not overlap.
  virtual void render(const TileWork& work, Workspace& workspace, scene::Film& film) const = 0;
  /// Adds what was put off. To be called with all workspaces that render() had since the last such call, on one thread,
  /// while it is called on none.
  virtual void finish(std::span<const std::unique_ptr<Workspace>>, scene::Film&) const {}
  /// Makes ready for a film or a camera other than those before, and after a rendering that was abandoned: workspaces
  /// of before are of no use any more. What is view-independent stays in the caches.
  virtual void begin_again() const {}
  /// The caches, without their counts.
  virtual std::vector<CacheState> caches() const { return {}; }
  /// render() knows the part of light that is direct (Film::Settings::direct).
  virtual bool tells_direct() const { return false; }
  /// The same of all camera samples; else no light of the others counts as direct.
  virtual bool tells_all_direct() const { return tells_direct(); }
  /// No two camera samples share what they find: the variance of a pixel's samples is that of its error.
  virtual bool samples_are_independent() const { return false; }
  virtual ShaftTables shaft_tables() const { return {}; }
  /// After the last call of render(): writes what caches did for each pixel, where the film keeps that
  /// (Film::Settings::cache_use). `pixel_samples`: of the work.
  virtual void view_caches(uint32_t /*pixel_samples*/, scene::Film&) const {}
};

}  // namespace dapple::integrate
