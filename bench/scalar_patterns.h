// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/pattern/noise.h"

/// What a programmer would write for one point: branches, libm, early exits. Nodes by the names of bench/patterns.cpp.
namespace dapple::bench {

inline float clamp(float x, float low, float high) {
  return std::clamp(x, low, high);
}
inline float mix(float a, float b, float t) {
  return a * (1 - t) + b * t;
}
inline RGB mix(RGB a, RGB b, float t) {
  return a * (1 - t) + b * t;
}
inline float smoothstep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

inline float gradient_product(int hash, float x, float y, float z) {
  static constexpr int8_t gradients[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                              {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                              {1, 1, 0},  {-1, 1, 0},  {0, 1, -1}, {0, -1, -1}};
  const int8_t* g = gradients[hash & 15];
  return static_cast<float>(g[0]) * x + static_cast<float>(g[1]) * y + static_cast<float>(g[2]) * z;
}

inline float gradient_noise(const V3f& p) {
  const auto permute = [](int i) {
    return static_cast<int>(pattern::lane::tables::permutation[static_cast<size_t>(i & 255)]);
  };
  const float fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const int i = static_cast<int>(fx), j = static_cast<int>(fy), k = static_cast<int>(fz);
  const float x = p.x - fx, y = p.y - fy, z = p.z - fz;
  const auto fade = [](float t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  const float u = fade(x), v = fade(y), w = fade(z);
  const int a = permute(i), b = permute(i + 1);
  const int aa = permute(a + j), ab = permute(a + j + 1), ba = permute(b + j), bb = permute(b + j + 1);
  const auto slice = [&](int dz) {
    const float fz1 = z - static_cast<float>(dz);
    return mix(mix(gradient_product(permute(aa + k + dz), x, y, fz1),
                   gradient_product(permute(ba + k + dz), x - 1, y, fz1), u),
               mix(gradient_product(permute(ab + k + dz), x, y - 1, fz1),
                   gradient_product(permute(bb + k + dz), x - 1, y - 1, fz1), u),
               v);
  };
  return mix(slice(0), slice(1), w);
}

struct Point {
  V3f p, dx, dy;
};

inline float octaves(const Point& q, int most, bool absolute) {
  const float width2 = std::max(length2(q.dx), length2(q.dy));
  const float n =
      width2 > 0 ? std::clamp(-1 - 0.5f * std::log2(width2), 0.0f, static_cast<float>(most)) : static_cast<float>(most);
  float sum = 0, frequency = 1, amplitude = 1;
  for (int i = 0; i < most; ++i) {
    const float w = smoothstep(0.3f, 0.7f, n - static_cast<float>(i));
    if (w == 0 && !absolute) break;
    const float v = w > 0 ? gradient_noise(q.p * frequency) : 0;
    sum += absolute ? amplitude * mix(0.2f, std::abs(v), w) : amplitude * w * v;
    frequency *= 1.99f;
    amplitude *= 0.5f;
  }
  return sum;
}

inline float weight(const Point& q) {
  const float width2 = std::max(length2(q.dx), length2(q.dy));
  return width2 > 0 ? smoothstep(0.3f, 0.7f, -1 - 0.5f * std::log2(width2)) : 1;
}

struct ScalarNodes {
  using Float = float;
  using Color = RGB;
  using Point = bench::Point;
  V3f p, dx, dy;

  float number(float v) { return v; }
  Point place() { return {p, dx, dy}; }
  Point scaled(const Point& q, float s) { return {q.p * s, q.dx * s, q.dy * s}; }
  /// Footprints of the warp by forward differences would cost as much again; by hand one leaves them out.
  Point warped(const Point& q, float w) { return {q.p + V3f(w, 0, 0), q.dx, q.dy}; }
  float height(const Point& q) { return q.p.y; }
  float sine(float x) { return std::sin(x); }
  float power(float x, float y) { return std::pow(x, y); }
  float fbm(const Point& q, int n) { return octaves(q, n, false); }
  float turbulence(const Point& q, int n) { return octaves(q, n, true); }
  float perlin(const Point& q) { return octaves(q, 1, false); }
  float edge_distance(const Point& q) {
    const int i = static_cast<int>(std::floor(q.p.x)), j = static_cast<int>(std::floor(q.p.y)),
              k = static_cast<int>(std::floor(q.p.z));
    float f1 = 100, f2 = 100;
    for (int z = k - 1; z <= k + 1; ++z)
      for (int y = j - 1; y <= j + 1; ++y)
        for (int x = i - 1; x <= i + 1; ++x) {
          const uint32_t h = pattern::lane::lattice_hash(x, y, z);
          const V3f at(static_cast<float>(x) + pattern::lane::unit_of(h),
                       static_cast<float>(y) + pattern::lane::unit_of(h >> 10),
                       static_cast<float>(z) + pattern::lane::unit_of(h >> 20));
          const float d = length2(at - q.p);
          if (d < f1)
            f2 = f1, f1 = d;
          else if (d < f2)
            f2 = d;
        }
    const float w = weight(q);
    return mix(0.76f, std::sqrt(f2), w) - mix(0.535f, std::sqrt(f1), w);
  }
  template <class T>
  T ramp(float x, std::span<const float> at, std::span<const T> y) {
    if (x <= at.front()) return y.front();
    for (size_t k = 0; k + 1 < at.size(); ++k)
      if (x < at[k + 1]) return y[k] + (y[k + 1] - y[k]) * ((x - at[k]) / (at[k + 1] - at[k]));
    return y.back();
  }
  float ramp(float x, std::span<const float> at, std::span<const float> y) { return ramp<float>(x, at, y); }
  RGB ramp(float x, std::span<const float> at, std::span<const RGB> y) { return ramp<RGB>(x, at, y); }
  RGB color(const RGB& c) { return c; }
  RGB hue_shifted(const RGB& c, float shift) {
    const float high = c.max(), low = c.min(), chroma = high - low;
    float h = 0;
    if (chroma > 0)
      h = high == c.r ? (c.g - c.b) / chroma : high == c.g ? (c.b - c.r) / chroma + 2 : (c.r - c.g) / chroma + 4;
    h = h / 6 + shift;
    h = 6 * (h - std::floor(h));
    const float s = high > 0 ? chroma / high : 0;
    const auto channel = [&](float k) {
      return high * (1 - s * (1 - std::clamp(std::abs(std::fmod(h + k, 6.0f) - 3) - 1, 0.0f, 1.0f)));
    };
    return {channel(0), channel(4), channel(2)};
  }
};

}  // namespace dapple::bench
