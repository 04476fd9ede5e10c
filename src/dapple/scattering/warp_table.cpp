// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/warp_table.h"

#include <algorithm>
#include <cmath>

namespace dapple::scattering {

namespace {

/// Where the integral of a line from `a` to `b` over [0, 1] reaches `area`.
float solve(float a, float b, float area) {
  const float root = a + std::sqrt(std::max(a * a + 2 * area * (b - a), 0.0f));
  return root > 0 ? std::clamp(2 * area / root, 0.0f, 1.0f) : 0.5f;
}

struct Cell {
  int i;
  float t;
};
Cell cell(float x, int nodes) {
  const float f = std::clamp(x, 0.0f, 1.0f) * float(nodes - 1);
  const int i = std::min(int(f), nodes - 2);
  return {i, f - float(i)};
}

/// The last i of [0, n - 1) with before(i) <= u.
template <class Before>
int last_below(int n, float u, const Before& before) {
  int low = 0, high = n - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (before(middle) <= u ? low : high) = middle;
  }
  return low;
}

}  // namespace

WarpTable::WarpTable(std::vector<float> values, int height, int width, bool normalised)
    : height_(height), width_(width), values_(std::move(values)) {
  slices_ = values_.size() / cells();
  for (float& v : values_)
    if (!(v >= 0 && std::isfinite(v))) v = 0;
  if (!normalised) return;
  rows_.resize(values_.size());
  whole_.resize(slices_ * size_t(height_));
  for (size_t s = 0; s < slices_; ++s) {
    float *v = &values_[s * cells()], *along = &rows_[s * cells()], *whole = &whole_[s * size_t(height_)];
    const auto add_up = [&] {
      double sum = 0;
      for (int r = 0; r < height_; ++r) {
        double line = 0;
        along[index(r, 0)] = 0;
        for (int c = 1; c < width_; ++c) {
          line += (double(v[index(r, c - 1)]) + double(v[index(r, c)])) / 2 / (width_ - 1);
          along[index(r, c)] = float(line);
        }
        whole[r] = 0;
        if (r == 0) continue;
        sum += (double(along[index(r - 1, width_ - 1)]) + double(along[index(r, width_ - 1)])) / 2 / (height_ - 1);
        whole[r] = float(sum);
      }
      return sum;
    };
    const double mass = add_up();
    if (mass > 1e-30)
      for (size_t i = 0; i < cells(); ++i) v[i] = float(double(v[i]) / mass);
    else
      std::fill_n(v, cells(), 1.0f);
    add_up();
  }
}

float WarpTable::mean(const std::vector<float>& of, size_t stride, size_t at, const TableSlices& s) const {
  float sum = 0;
  for (int k = 0; k < 4; ++k)
    if (s.weight[k] > 0) sum += s.weight[k] * of[size_t(s.index[k]) * stride + at];
  return sum;
}

float WarpTable::evaluate(const V2f& at, const TableSlices& s) const {
  const Cell x = cell(at.x, width_), y = cell(at.y, height_);
  return lerp(y.t, lerp(x.t, value(y.i, x.i, s), value(y.i, x.i + 1, s)),
              lerp(x.t, value(y.i + 1, x.i, s), value(y.i + 1, x.i + 1, s)));
}

V2f WarpTable::sample(const V2f& u, const TableSlices& s, float* density) const {
  const auto below = [&](int r) { return mean(whole_, size_t(height_), size_t(r), s); };
  const int r = last_below(height_, u.y, below);
  const float first = before(r, width_ - 1, s), second = before(r + 1, width_ - 1, s);
  const float y = solve(first, second, std::max(u.y - below(r), 0.0f) * float(height_ - 1));
  const auto left = [&](int c) { return lerp(y, before(r, c, s), before(r + 1, c, s)); };
  const float wanted = u.x * lerp(y, first, second);
  const int c = last_below(width_, wanted, left);
  const float a = lerp(y, value(r, c, s), value(r + 1, c, s)), b = lerp(y, value(r, c + 1, s), value(r + 1, c + 1, s));
  const float x = solve(a, b, std::max(wanted - left(c), 0.0f) * float(width_ - 1));
  *density = lerp(x, a, b);
  return V2f((float(c) + x) / float(width_ - 1), (float(r) + y) / float(height_ - 1));
}

V2f WarpTable::invert(const V2f& at, const TableSlices& s, float* density) const {
  const Cell x = cell(at.x, width_), y = cell(at.y, height_);
  const float first = before(y.i, width_ - 1, s), second = before(y.i + 1, width_ - 1, s),
              total = lerp(y.t, first, second);
  const float a = lerp(y.t, value(y.i, x.i, s), value(y.i + 1, x.i, s)),
              b = lerp(y.t, value(y.i, x.i + 1, s), value(y.i + 1, x.i + 1, s));
  *density = lerp(x.t, a, b);
  const float across =
      lerp(y.t, before(y.i, x.i, s), before(y.i + 1, x.i, s)) + x.t * (a + 0.5f * x.t * (b - a)) / float(width_ - 1);
  const float down = mean(whole_, size_t(height_), size_t(y.i), s) +
                     y.t * (first + 0.5f * y.t * (second - first)) / float(height_ - 1);
  return V2f(total > 0 ? std::clamp(across / total, 0.0f, 1.0f) : x.t, std::clamp(down, 0.0f, 1.0f));
}

}  // namespace dapple::scattering
