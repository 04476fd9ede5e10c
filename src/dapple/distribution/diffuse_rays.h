// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_scene.h"

namespace dapple::distribution {

/// Draws the diffuse rays of points: cosine distributed over the sides that reflect or transmit.
class DiffuseRays {
 public:
  /// `cached`: what they meet is answered by the radiosity cache.
  DiffuseRays(const ShadingScene& shading, bool cached) : shading_(shading), cached_(cached) {}

  /// What so many diffuse rays from point k have in common.
  struct Fan {
    int point;
    float solid_angle;  ///< of the projected hemisphere: sr a ray
    float spread;       ///< RaySet::spread and share
    int share;
  };
  /// `points`: of one pixel, whose rays count with these: what each finds is no more blurred than if one sent them all.
  Fan fan(const integrate::PointBatch& b, int k, int rays, int points = 1) const;
  /// Of the one ray of a point that many share: with which chance it goes on (Arvo and Kirk 1990, Russian roulette).
  static float chance(const Place& place, const integrate::PointBatch& b, int k, int rays);
  /// Writes ray i of a set, of weight one: one of these along d, at an angle of this cosine with the normal.
  void set(const integrate::PointBatch& b, const Fan& fan, integrate::RaySet& r, int i,
           const integrate::RayOrigin& from, const V3f& d, float cosine, uint32_t key) const;

  /// Jobs for the first `count` of so many diffuse rays of point k. flush() makes room, by draw(). Which jobs of a
  /// point stand in a batch together does not depend on other points: they are ordered, and their rays joined.
  template <class Flush>
  static void add_jobs(const Place& place, const integrate::PointBatch& b, int k, int count, int rays,
                       ShadingWorkspace& w, const Flush& flush) {
    const float chance = DiffuseRays::chance(place, b, k, rays);
    if (chance < 1 && to_unit_float(random_of(b.key[k], Purpose::roulette)) >= chance) return;
    const uint32_t seed = seed_of(b.sequence[k], Purpose::diffuse_rays);
    for (int i = 0; i < count; ++i) {
      if (i % w.capacity == 0 && w.job_count + std::min(count - i, w.capacity) > w.capacity) flush();
      const int job = w.job_count++;
      w.seed[job] = seed;
      w.index[job] = b.number[k] * uint32_t(rays) + uint32_t(i);
      w.job_weight[job] = 1 / (float(rays) * chance);
      w.job_point[job] = k;
    }
  }
  /// Draws all jobs of the workspace into a set of rays of the batch at `place`.
  void draw(const Place& place, integrate::RaySet& r, ShadingWorkspace& w) const;

 private:
  const ShadingScene& shading_;
  const bool cached_;
};

}  // namespace dapple::distribution
