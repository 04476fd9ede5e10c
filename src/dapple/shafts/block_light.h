// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "dapple/pattern/lane_math.h"
#include "dapple/shafts/scan_planes.h"

/// Light of blocks of bins along one view ray, for AirLight. What a point of the ray would send were it lit is smooth
/// along it. So it is computed at the ends and in the middle of each block of bins, and the parabola through these
/// three numbers is integrated over what is lit of each bin: exponentials a block, not a bin.
namespace dapple::shafts {

/// m(y) = (1 - e^-y) / y for y >= 0.
DAPPLE_LANE float mean_decay_of(float y) {
  namespace lane = pattern::lane;
  const float series = 1 - y * (1 / 2.0f - y * (1 / 6.0f - y * (1 / 24.0f - y * (1 / 120.0f - y * (1 / 720.0f)))));
  const float direct = (1 - lane::exp(-y)) / (y > 0.3f ? y : 1.0f);
  return lane::choose(y > 0.3f, direct, series);
}

/// Column over a length t, of a density at its begin that falls at a rate.
DAPPLE_LANE float column_of(float density, float rate, float t) {
  namespace lane = pattern::lane;
  const float y = rate * t, size = lane::abs(y);
  return density * t * mean_decay_of(size) * (y < 0 ? lane::exp(size) : 1.0f);
}

/// What so many blocks from `first` on would send were they lit. Of block first + n node n is the begin, n + 1 the end
/// and half + n the middle; of the first and last block along a ray that part counts through which the ray goes.
struct BlockNodes {
  static constexpr int blocks = 15, half = 16, count = 2 * half;
  int first = -1;                        ///< -1: nothing
  float brightest[3] = {0, 0, 0};        ///< so far
  alignas(64) float u[count];            ///< coordinate of rays of light
  alignas(64) float weight[count];       ///< light = weight e^-exponent, a unit of u
  alignas(64) float way[count];          ///< column to the light, without what entry() of the planes subtracts
  alignas(64) float exponent[3][count];  ///< by channel, without that too
  alignas(64) float light[3][3 * half];  ///< begins, middles, ends: where light enters, each block has its own
  alignas(64) float whole[3][half];      ///< Simpson's rule for blocks
  alignas(64) float bend[half];          ///< above 0: a parabola is not enough for the light

  bool holds(int block) const { return first >= 0 && block >= first && block < first + blocks; }
  /// u, from the edges of blocks.
  void set_places(const float* edges, float begin, float end) {
    for (int n = 0; n < half; ++n) u[n] = pattern::lane::clamp(edges[n], begin, end);
    for (int n = 0; n < blocks; ++n) u[half + n] = 0.5f * (u[n] + u[n + 1]);
    u[half + blocks] = u[blocks];
  }
  /// The light of channel c, from what else there is. `entry`: of each block, at its begin and end (EntryLine); null:
  /// nothing is subtracted.
  void find_light(int c, float sigma, const EntryLine* entry, const float* edges) {
    namespace lane = pattern::lane;
    float* const to = light[c];
    if (!entry) {
      for (int n = 0; n < count; ++n) to[n] = weight[n] * lane::exp(-exponent[c][n]);
      for (int n = 0; n < blocks; ++n) to[count + n] = to[n + 1];
      to[count + blocks] = to[blocks];
      return;
    }
    alignas(64) float depth[3 * half], factor[3 * half];
    for (int n = 0; n < half; ++n) {
      const float at = entry[n].begin, width = edges[n + 1] - edges[n];
      const float per_u = sigma * (entry[n].end - at) / (width > 0 ? width : 1.0f),
                  known = sigma * at - per_u * edges[n];
      const int next = n < blocks ? n + 1 : n;
      depth[n] = exponent[c][n] - (known + per_u * u[n]);
      depth[half + n] = exponent[c][half + n] - (known + per_u * u[half + n]);
      depth[count + n] = exponent[c][next] - (known + per_u * u[next]);
      factor[n] = weight[n], factor[half + n] = weight[half + n], factor[count + n] = weight[next];
    }
    for (int n = 0; n < 3 * half; ++n) to[n] = factor[n] * lane::exp(-depth[n]);
  }
  /// After the rest.
  void finish(int channels) {
    alignas(64) float width[half];
    for (int n = 0; n < blocks; ++n) width[n] = (u[n + 1] - u[n]) * (1 / 6.0f);
    width[blocks] = 0;
    for (int n = 0; n < half; ++n) bend[n] = 0;
    for (int c = 0; c < channels; ++c) {
      float most = brightest[c];
      for (int n = 0; n < blocks; ++n) most = std::max(most, light[c][n]);
      brightest[c] = most;
      for (int n = 0; n < half; ++n) {
        const float a = light[c][n], m = light[c][half + n], b = light[c][count + n];
        whole[c][n] = width[n] * (a + b + 4 * m);
        const float size = pattern::lane::max(pattern::lane::max(a, b), m) + faint * most;
        // A turning point may hide a bend.
        bend[n] = pattern::lane::max(bend[n], pattern::lane::abs(a + b - 2 * m) - most_bend * size);
        bend[n] = pattern::lane::max(bend[n], pattern::lane::abs(a - b) - most_change * size);
      }
    }
  }
  /// A parabola is not enough for the logarithm of the light of block n.
  bool is_steep(int n, int channels) const {
    for (int c = 0; c < channels; ++c)
      if (!(std::abs(exponent[c][n + 1] - exponent[c][n]) <= most_depth)) return true;
    const float a = weight[n], m = weight[half + n], b = weight[n + 1];
    return !(std::abs(a - 2 * m + b) <= most_bend * std::max(std::max(a, m), b));
  }
  static constexpr float most_bend = 0.02f;  // light of depths .3 apart: the parabola is off by 2e-4 at most
  static constexpr float faint = 0.05f;      // of the brightest: no more care than for that
  static constexpr float most_change = 0.35f, most_depth = 0.4f;
};

/// The parabola through three numbers at 0, 1/2 and 1.
struct Parabola {
  float a, b, c;
  Parabola(float at_0, float middle, float at_1)
      : a(at_0), b(4 * middle - 3 * at_0 - at_1), c(2 * (at_0 + at_1) - 4 * middle) {}
};

/// What is lit of each bin of a block: u from `begin` to `end`.
struct LitBins {
  alignas(64) float begin[ScanPlanes::block], end[ScanPlanes::block];
};

/// What is lit of blocks of which the nodes are: by block, -1 or 0, for vector code.
struct BlockStates {
  alignas(64) int32_t open[BlockNodes::half];  ///< not dark as a whole
  alignas(64) int32_t lit[BlockNodes::half];   ///< as a whole
  bool all_lit(int n) const {
    int32_t all = -1;
    for (int i = 0; i < n; ++i) all &= lit[i];
    return all != 0;
  }
  bool any() const {
    int32_t some = 0;
    for (int n = 0; n < BlockNodes::half; ++n) some |= open[n];
    return some != 0;
  }
};

/// Sums by channel, in lanes, that are added up at the end: always in the same order.
struct LaneSums {
  static constexpr int lanes = ScanPlanes::block;
  alignas(64) float of[3][lanes] = {};
  float sum(int c) const {
    float all = 0;
    for (int i = 0; i < lanes / 2; ++i) all += of[c][i] + of[c][i + lanes / 2];
    return all;
  }
};

/// Adds what is lit of block n of the nodes, whose rays of light are alike: times `tint`. `from`, `to`: the channel of
/// the nodes, and the first and last of the sums that it is for.
inline void add_smooth(const BlockNodes& nodes, int n, const LitBins& lit, int from, int to, int last, const RGB* tint,
                       bool even, LaneSums* sums) {
  constexpr int size = ScanPlanes::block;
  const float u0 = nodes.u[n], width = nodes.u[n + 1] - u0, per_u = width > 0 ? 1 / width : 0.0f;
  const float* const at = nodes.light[from] + n;
  const Parabola p(at[0], at[BlockNodes::half], at[BlockNodes::count]);
  alignas(64) float light[size];
  for (int i = 0; i < size; ++i) {
    const float length = lit.end[i] - lit.begin[i];
    const float x = (0.5f * (lit.begin[i] + lit.end[i]) - u0) * per_u, half = 0.5f * length * per_u;
    const float mean = p.a + x * (p.b + x * p.c) + p.c * (1 / 3.0f) * half * half;
    light[i] = length > 0 ? length * mean : 0.0f;
  }
  for (int c = to; c <= last; ++c) {
    float* const out = sums->of[c];
    if (even) {
      const float t = tint ? (*tint)[c] : 1.0f;
      for (int i = 0; i < size; ++i) out[i] += light[i] * t;
    } else {
      for (int i = 0; i < size; ++i) out[i] += light[i] * tint[i][c];
    }
  }
}

/// The same where light enters the medium somewhere, each ray of light by itself. sigma: extinction of channel `from`.
inline void add_entering(const BlockNodes& nodes, int n, const LitBins& lit, int from, int to, int last, float sigma,
                         const float* entry, const RGB* tint, bool checks_way, LaneSums* sums) {
  namespace lane = pattern::lane;
  constexpr int size = ScanPlanes::block;
  const float u0 = nodes.u[n], width = nodes.u[n + 1] - u0, per_u = width > 0 ? 1 / width : 0.0f;
  const auto along = [&](const float* f) { return Parabola(f[n], f[BlockNodes::half + n], f[n + 1]); };
  const Parabola depth = along(nodes.exponent[from]), weight = along(nodes.weight), way = along(nodes.way);
  alignas(64) float light[size];
  for (int i = 0; i < size; ++i) {
    const float length = lit.end[i] - lit.begin[i];
    const float x = (0.5f * (lit.begin[i] + lit.end[i]) - u0) * per_u;
    const float z = 0.5f * length * per_u * (depth.b + 2 * x * depth.c), mean = 1 + z * z * (1 / 6.0f);
    const float known = lane::min(entry[i], 1e30f);
    const float exponent = depth.a + x * (depth.b + x * depth.c) - sigma * known;
    const bool beyond = way.a + x * (way.b + x * way.c) < known;
    const float value = length * mean * (weight.a + x * (weight.b + x * weight.c)) * lane::exp(-exponent);
    light[i] = lane::choose((length > 0) & (entry[i] < 1e30f) & !(checks_way & beyond), value, 0);
  }
  for (int c = to; c <= last; ++c) {
    float* const out = sums->of[c];
    if (tint)
      for (int i = 0; i < size; ++i) out[i] += light[i] * tint[i][c];
    else
      for (int i = 0; i < size; ++i) out[i] += light[i];
  }
}

}  // namespace dapple::shafts
