// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "dapple/base/ray.h"
#include "dapple/base/rgb.h"

namespace dapple::trace {

inline constexpr uint32_t no_id = ~0u;

/// Sets of the channels of RGB, as bits.
inline constexpr uint8_t no_channel = 0, all_channels = 7;

/// RayBatch::key of one of many rays of a seed.
inline uint32_t ray_key(uint32_t seed, uint32_t index) {
  return seed + 0x9e3779b9u * index;
}

/// Rays in batches, structure of arrays. tnear is 0: callers move origins off surfaces.
struct RayBatch {
  static constexpr int capacity = 256;
  static constexpr int packet = 16;  ///< rays that are traced together at most; divides the capacity
  /// Of a point towards one light, or in all directions if alike ones follow each other. Fewer, in packets, gain
  /// nothing in most scenes.
  static constexpr bool pays_to_join(int rays) { return rays > packet; }
  alignas(64) float ox[capacity], oy[capacity], oz[capacity];
  alignas(64) float dx[capacity], dy[capacity], dz[capacity];
  alignas(64) float t_max[capacity];
  alignas(64) float time[capacity];    ///< [0, 1] over the shutter interval
  alignas(64) uint32_t key[capacity];  ///< random key for stochastic opacity
  alignas(64) float width[capacity],
      spread[capacity];  ///< of the footprint: at the origin, and its growth a unit of distance
  /// The ray may be traced in one packet with the ray before it, which is faster if they are alike. What either meets
  /// can then depend on the other, by rounding and where surfaces coincide: only for rays that are always traced
  /// together, whatever the batch.
  bool joined[capacity];

  /// Joined to none. Without a footprint cut-out surfaces are met as they are, uncached.
  void set(int i, const V3f& o, const V3f& d, float max_distance, float ray_time, uint32_t ray_key, float ray_width = 0,
           float ray_spread = 0) {
    ox[i] = o.x, oy[i] = o.y, oz[i] = o.z;
    dx[i] = d.x, dy[i] = d.y, dz[i] = d.z;
    t_max[i] = max_distance, time[i] = ray_time, key[i] = ray_key;
    width[i] = ray_width, spread[i] = ray_spread;
    joined[i] = false;
  }
  void copy_lane(int to, const RayBatch& o, int from) {
    set(to, o.origin(from), o.direction(from), o.t_max[from], o.time[from], o.key[from], o.width[from], o.spread[from]);
  }
  V3f origin(int i) const { return {ox[i], oy[i], oz[i]}; }
  V3f direction(int i) const { return {dx[i], dy[i], dz[i]}; }
};

/// What the rays of a batch met; geometry is no_id for a miss.
struct HitBatch {
  static constexpr int capacity = RayBatch::capacity;
  alignas(64) float t[capacity], u[capacity], v[capacity];
  alignas(64) float nx[capacity], ny[capacity],
      nz[capacity];                         ///< normal: curves only need it; of flat ones back along the ray
  alignas(64) uint32_t geometry[capacity];  ///< index in TracedScene's table of geometries
  alignas(64) uint32_t primitive[capacity];
  alignas(64) uint32_t instance[capacity];  ///< no_id if not instanced
  /// Where opacity differs by channel, light of some channels ends elsewhere than where the ray did: those that went
  /// with it. Set only in scenes that have such.
  alignas(64) uint8_t channels[capacity];

  void copy_lane(int to, const HitBatch& o, int from) {
    t[to] = o.t[from], u[to] = o.u[from], v[to] = o.v[from];
    nx[to] = o.nx[from], ny[to] = o.ny[from], nz[to] = o.nz[from];
    geometry[to] = o.geometry[from], primitive[to] = o.primitive[from], instance[to] = o.instance[from];
    channels[to] = o.channels[from];
  }
  /// What stands for all light by that of the channels of lane i.
  RGB weight(int i) const {
    const uint8_t bits = channels[i];
    const float each = 3 / float(std::popcount(bits));
    return {bits & 1 ? each : 0, bits & 2 ? each : 0, bits & 4 ? each : 0};
  }
};

}  // namespace dapple::trace
