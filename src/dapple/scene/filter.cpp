// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/filter.h"

namespace dapple::scene {

namespace {

constexpr int bins = 512;

float sinc(float x) {
  return std::abs(x) < 1e-4f ? 1 - sqr(pi * x) / 6 : std::sin(pi * x) / (pi * x);
}

float gaussian(float x, float sigma) {
  return std::exp(-x * x / (2 * sigma * sigma));
}

// Mitchell & Netravali 1988; x scaled so that the support is [-2, 2].
float mitchell(float x, float b, float c) {
  x = std::abs(x);
  if (x <= 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
  if (x <= 2)
    return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) / 6;
  return 0;
}

}  // namespace

Filter::Filter(FilterKind kind, const V2f& radius, float a, float b) : kind_(kind), radius_(radius), a_(a), b_(b) {
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> sums(bins + 1, 0);
    const float width = 2 * radius_[axis] / bins;
    for (int i = 0; i < bins; ++i) {
      const float f = evaluate(axis, (float(i) + .5f) * width - radius_[axis]);
      sums[size_t(i) + 1] = sums[size_t(i)] + std::abs(double(f));
      has_negative_lobes_ = has_negative_lobes_ || f < 0;
    }
    Axis& table = axes_[axis];
    table.cdf.resize(bins + 1);
    for (int i = 0; i <= bins; ++i) table.cdf[size_t(i)] = float(sums[size_t(i)] / sums[bins]);
    table.cdf[bins] = 1;
    table.total = float(sums[bins] * width);
  }
}

float Filter::evaluate(int axis, float x) const {
  const float r = radius_[axis];
  if (std::abs(x) > r) return 0;
  switch (kind_) {
    case FilterKind::box:
      return 1;
    case FilterKind::triangle:
      return r - std::abs(x);
    case FilterKind::gaussian:
      return std::max(0.0f, gaussian(x, a_) - gaussian(r, a_));
    case FilterKind::mitchell:
      return mitchell(2 * x / r, a_, b_);
    case FilterKind::sinc:
      return sinc(x) * sinc(x / a_);
  }
  return 0;
}

float Filter::sample_axis(int axis, float u, float* weight) const {
  const float r = radius_[axis];
  if (kind_ == FilterKind::triangle) return u < .5f ? r * (std::sqrt(2 * u) - 1) : r * (1 - std::sqrt(2 * (1 - u)));
  const auto& cdf = axes_[axis].cdf;
  const auto it = std::upper_bound(cdf.begin(), cdf.end(), u);
  const int i = std::clamp(int(it - cdf.begin()) - 1, 0, bins - 1);
  const float p = cdf[size_t(i) + 1] - cdf[size_t(i)];
  const float x = (float(i) + (p > 0 ? (u - cdf[size_t(i)]) / p : .5f)) * (2 * r / bins) - r;
  const float density = p * bins / (2 * r);
  *weight *= density > 0 ? evaluate(axis, x) / (axes_[axis].total * density) : 0;
  return x;
}

Filter::Sample Filter::sample_general(const V2f& u) const {
  Sample s{V2f(0, 0), 1};
  s.offset.x = sample_axis(0, u.x, &s.weight);
  s.offset.y = sample_axis(1, u.y, &s.weight);
  return s;
}

}  // namespace dapple::scene
