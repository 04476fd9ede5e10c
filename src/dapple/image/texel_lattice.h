// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "dapple/image/texture_system.h"

namespace dapple::image {

/// A coordinate as OpenImageIO and integer arithmetic can take it, with the same meaning.
inline float sane_coordinate(float v, Wrap wrap) {
  if (!std::isfinite(v)) return 0;
  return wrap == Wrap::repeat ? v - std::floor(v) : std::clamp(v, -16.0f, 17.0f);
}

/// Column or row i of n, wrapped; -1 outside a picture that is black there.
inline int wrap_index(int i, int n, Wrap wrap) {
  if (i >= 0 && i < n) return i;
  if (wrap == Wrap::black) return -1;
  if (wrap == Wrap::clamp) return i < 0 ? 0 : n - 1;
  const int m = i % n;
  return m < 0 ? m + n : m;
}

/// The texels of a picture's finest level about a point, as look-ups without a footprint interpolate them.
struct TexelLattice {
  struct Corners {
    int count;       ///< 1 for the nearest texel, else 4
    int x[4], y[4];  ///< -1: black
    float weight[4];
  };
  int width = 1, height = 1;
  Wrap wrap = Wrap::repeat;
  TextureFilter filter = TextureFilter::bilinear;

  /// s, t: sane coordinates, t downwards.
  Corners corners(float s, float t) const {
    const float x = s * static_cast<float>(width), y = t * static_cast<float>(height);
    const auto column = [this](int i) { return wrap_index(i, width, wrap); };
    const auto row = [this](int j) { return wrap_index(j, height, wrap); };
    if (filter == TextureFilter::point)
      return {1, {column(static_cast<int>(std::floor(x)))}, {row(static_cast<int>(std::floor(y)))}, {1}};
    const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
    const float u = x - 0.5f - fx, v = y - 0.5f - fy;
    const int x0 = column(static_cast<int>(fx)), x1 = column(static_cast<int>(fx) + 1);
    const int y0 = row(static_cast<int>(fy)), y1 = row(static_cast<int>(fy) + 1);
    return {4, {x0, x1, x0, x1}, {y0, y0, y1, y1}, {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
  }
};

}  // namespace dapple::image
