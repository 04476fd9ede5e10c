// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/base/ray.h"
#include "dapple/base/rgb.h"
#include "dapple/media/phase_function.h"
#include "dapple/pattern/shading_points.h"

namespace dapple::media {

/// A free flight through a medium, drawn by Medium::sample.
struct MediumSample {
  bool scattered = false;  ///< at t; else the flight reached t_max
  float t = 0;             ///< distance along the ray
  /// Transmittance to t, times the scattering coefficient where scattered, over the density of the draw: what the
  /// path's throughput is to be multiplied by.
  RGB weight{1};
  RGB emitted;  ///< estimate of the radiance the medium itself adds along [0, t_max], seen from the ray's origin
};

/// A ray that does not gamble: what is left of it at its end, what the medium adds, and one place at which it scatters,
/// if it does at all: as MediumSample, but that
///   E[weight f(t)] = int_0^t_max T(t) sigma_s(t) f(t) dt.
struct MediumCrossing {
  RGB transmittance{1};
  RGB emitted;
  MediumSample scattering;
};

/// Rays through one medium, each from its origin to its own t_max.
struct MediumRays {
  static constexpr int capacity = pattern::ShadingPoints::capacity;
  int count = 0;
  Ray ray[capacity];  ///< with t_max; unit d
  RGB beta[capacity];
  uint64_t key[capacity];

  void add(const Ray& r, float t_max, const RGB& throughput, uint64_t k) {
    ray[count] = r;
    ray[count].t_max = t_max;
    beta[count] = throughput;
    key[count++] = k;
  }
};

/// A participating medium. Coefficients may differ by channel; scattering is after Henyey and Greenstein. Rays are in
/// world space, d unit. Where an estimate is random, its numbers come from `key` alone. Immutable, thread-safe.
class Medium {
 public:
  explicit Medium(HenyeyGreenstein phase) : phase_(phase) {}
  virtual ~Medium() = default;

  /// Draws how far light goes along the ray before it scatters, at most to t_max (may be infinite). `beta`: throughput
  /// of the path, which weighs the channels in the draw and nothing else. Estimates are unbiased for every channel:
  ///   E[weight f(t) | scattered] P(scattered) = int_0^t_max T(t) sigma_s(t) f(t) dt,  E[weight | passed] P(passed) =
  ///   T(t_max).
  virtual MediumSample sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const = 0;
  /// Fraction of light that gets along the ray to t_max, unbiased.
  virtual RGB transmittance(const Ray& ray, float t_max, uint64_t key) const = 0;

  /// The same for a batch of rays: ray i gets what it would get alone. Media that are dear at a point do better here.
  virtual void sample_batch(const MediumRays& rays, MediumSample* out) const {
    for (int i = 0; i < rays.count; ++i) out[i] = sample(rays.ray[i], rays.ray[i].t_max, rays.beta[i], rays.key[i]);
  }
  virtual void transmittance_batch(const MediumRays& rays, RGB* out) const {
    for (int i = 0; i < rays.count; ++i) out[i] = transmittance(rays.ray[i], rays.ray[i].t_max, rays.key[i]);
  }

  /// The whole of the ray to t_max (may be infinite) at once; without `scatters` no place is drawn. Less noisy than
  /// sample(); media that differ from place to place may do with a quadrature (UnevenMedium).
  virtual MediumCrossing cross(const Ray& ray, float t_max, const RGB& beta, uint64_t key, bool scatters) const = 0;

  virtual bool emits() const = 0;  ///< false: MediumSample::emitted is black for certain
  /// What was wrong in it so far, as warnings for the user.
  virtual std::vector<std::string> warnings() const { return {}; }

  const HenyeyGreenstein& phase() const { return phase_; }

 private:
  HenyeyGreenstein phase_;
};

/// What was wrong in these media so far.
inline std::vector<std::string> medium_faults(const std::vector<std::shared_ptr<const Medium>>& media) {
  std::vector<std::string> all;
  for (const auto& medium : media)
    for (std::string& warning : medium->warnings()) all.push_back(std::move(warning));
  return all;
}

}  // namespace dapple::media
