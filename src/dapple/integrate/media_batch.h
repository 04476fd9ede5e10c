// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/media/medium.h"
#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// Sends the rays of a batch through the media they are in, all those of one medium at once.
struct MediaBatch {
  static constexpr int capacity = media::MediumRays::capacity;
  media::MediumRays rays;
  int lane[capacity], waiting[capacity];
  media::MediumSample flown[capacity];
  RGB passed[capacity];

  /// Flights: out[i] of each lane i < n for which medium_of(i) is not scene::vacuum. add(i, &rays) adds the lane's ray.
  template <class MediumOf, class Add>
  void sample(const scene::Scene& scene, int n, const MediumOf& medium_of, const Add& add, media::MediumSample* out) {
    for_each_medium(n, medium_of, add, [&](int32_t medium) {
      scene.media[size_t(medium)]->sample_batch(rays, flown);
      for (int j = 0; j < rays.count; ++j) out[lane[j]] = flown[j];
    });
  }
  /// Transmittances, likewise; 1 for the other lanes.
  template <class MediumOf, class Add>
  void transmittance(const scene::Scene& scene, int n, const MediumOf& medium_of, const Add& add, RGB* out) {
    std::fill_n(out, n, RGB(1));
    for_each_medium(n, medium_of, add, [&](int32_t medium) {
      scene.media[size_t(medium)]->transmittance_batch(rays, passed);
      for (int j = 0; j < rays.count; ++j) out[lane[j]] = passed[j];
    });
  }

 private:
  template <class MediumOf, class Add, class Run>
  void for_each_medium(int n, const MediumOf& medium_of, const Add& add, const Run& run) {
    int left = 0;
    for (int i = 0; i < n; ++i)
      if (medium_of(i) != scene::vacuum) waiting[left++] = i;
    while (left > 0) {
      const int32_t medium = medium_of(waiting[0]);
      const int all = left;
      left = rays.count = 0;
      for (int j = 0; j < all; ++j) {
        const int i = waiting[j];
        if (medium_of(i) != medium) {
          waiting[left++] = i;
          continue;
        }
        lane[rays.count] = i;
        add(i, &rays);
      }
      run(medium);
    }
  }
};

}  // namespace dapple::integrate
