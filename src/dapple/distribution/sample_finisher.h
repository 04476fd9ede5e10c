// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/camera_samples.h"
#include "dapple/distribution/distribution_settings.h"
#include "dapple/distribution/hit_shader.h"

namespace dapple::distribution {

/// Camera samples that wait for shading points, or to be shaded in a batch with others. A pixel's samples leave in the
/// order in which they came, whatever the threads do: the film adds them up in that order.
struct WaitingSamples {
  static constexpr size_t most = 32 * CameraSamples::capacity;

  struct Waiting {
    CameraSample sample;
    GridStore::GridPtr grid;
    RGB L;
    std::vector<RGB> parts;  ///< of L
    bool done = false;
  };
  std::vector<Waiting> samples;
  int hits = 0;  ///< of them: Source::hit

  bool is_full() const { return samples.size() > most; }
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

/// Gives camera samples the light of the points that serve them, and what depends on the view, for each sample; adds
/// them to the film.
class SampleFinisher {
 public:
  SampleFinisher(const ShadingScene& shading, const HitShader& shader, const DistributionSettings& settings, int groups)
      : shading_(shading), shader_(shader), settings_(settings), groups_(groups) {}

  struct Scratch {
    explicit Scratch(int groups) : waiting_L(groups) {}

    WaitingSamples waiting;
    integrate::LightSums waiting_L;
    // Samples that are about to be finished, and where their light is.
    static constexpr int capacity = integrate::PointBatch::capacity;
    int count = 0;
    const CameraSample* sample[capacity];
    int sample_L[capacity];
    scene::Features features[capacity];
  };

  /// Finishes the samples that are ready; the others wait. `held`: of CameraSample::held.
  void add(CameraSamples& s, std::span<const GridStore::GridPtr> held, Scratch& scratch, ShadingWorkspace& w,
           scene::Film& film) const;
  /// Finishes those waiting samples whose points are ready.
  void finish_waiting(Scratch& scratch, ShadingWorkspace& w, scene::Film& film) const;

  /// Writes the inputs of point k of a batch: what a camera sample met.
  void set_point(const CameraSample& s, integrate::PointBatch& b, int k) const;

 private:
  void finish(integrate::LightSums& L, Scratch& scratch, ShadingWorkspace& w, scene::Film& film) const;
  void shade(Source source, ShadingWorkspace& w, const Scratch& scratch) const;
  scene::GridFeatures describe_grid(const CameraSample& s, scene::PatchTable::Extents* extents) const;

  const ShadingScene& shading_;
  const HitShader& shader_;
  const DistributionSettings& settings_;
  const int groups_;  // of lights, whose parts are kept apart
};

}  // namespace dapple::distribution
