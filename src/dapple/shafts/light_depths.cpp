// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/light_depths.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple::shafts {

using media::MediumPoint;
using media::MediumRays;
using media::UnevenMedium;

namespace {
constexpr int least_nodes = 4;
constexpr int samples_a_step = 2;  // along parallel light
}  // namespace

LightDepths::LightDepths(const UnevenMedium& medium, const Settings& settings) : settings_(settings) {
  const auto color = medium.extinction_color();
  channels_ = color ? 1 : 3;
  color_ = color.value_or(RGB(1));
  bounds_ = medium.bounds();
  if (!settings_.is_lamp) frame_ = Frame(settings_.light);
  if (settings_.nodes <= 0) settings_.nodes = settings_.is_lamp ? lamp_nodes : parallel_nodes;
  place(bounds_);
  while (nx_ * ny_ * nz_ * channels_ * sizeof(float) > settings_.max_bytes && settings_.nodes > least_nodes) {
    settings_.nodes = std::max(settings_.nodes * 3 / 4, least_nodes);
    place(bounds_);
  }
  values_.assign(nx_ * ny_ * nz_ * channels_, 0.0f);
  settings_.is_lamp ? fill_lamp(medium) : fill_parallel(medium);
}

void LightDepths::place(const Box3f& bounds) {
  V3f low(infinity, infinity, infinity), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const V3f P(corner & 1 ? bounds.max.x : bounds.min.x, corner & 2 ? bounds.max.y : bounds.min.y,
                corner & 4 ? bounds.max.z : bounds.min.z);
    const V3f in_frame(dot(P, frame_.s), dot(P, frame_.t), dot(P, frame_.n));
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], in_frame[k]), high[k] = std::max(high[k], in_frame[k]);
  }
  const V3f size = high - low;
  const float step = std::max({size.x, size.y, size.z, 1e-30f}) / float(settings_.nodes - 1);
  size_t* const count[3] = {&nx_, &ny_, &nz_};
  for (int k = 0; k < 3; ++k) {
    const float cells = std::clamp(std::ceil(size[k] / step - 1e-3f), 1.0f, float(settings_.nodes - 1));
    *count[k] = size_t(cells) + 1;
    step_[k] = std::max(size[k], 1e-30f) / cells;
    per_step_[k] = 1 / step_[k];
  }
  low_ = low;
}

// Of a piece of the way of this length.
void LightDepths::add(const MediumPoint& p, float length, float* sum) const {
  const RGB t = p.sigma_a + p.sigma_s;
  if (channels_ == 1) {
    sum[0] += t.max() * length;
  } else {
    for (int c = 0; c < 3; ++c) sum[c] += t[c] * length;
  }
}

// Rows of nodes along the light, from above.
void LightDepths::fill_parallel(const UnevenMedium& medium) {
  constexpr int steps = MediumRays::capacity / samples_a_step;
  parallel_for(ny_, [&](size_t y) {
    V3f P[MediumRays::capacity];
    MediumPoint point[MediumRays::capacity];
    for (size_t x = 0; x < nx_; ++x) {
      float sum[3] = {0, 0, 0};
      for (int top = int(nz_) - 1; top > 0; top -= steps) {
        const int n = std::min(steps, top);
        for (int i = 0; i < n * samples_a_step; ++i) {
          const float below = (float(i) + to_unit_float(hash(settings_.seed, x, y, top, i))) / samples_a_step;
          P[i] = place_of(float(x), float(y), float(top) - below);
        }
        medium.coefficients(P, 0, n * samples_a_step, point);
        for (int i = 0; i < n; ++i) {
          for (int k = 0; k < samples_a_step; ++k) add(point[i * samples_a_step + k], step_.z / samples_a_step, sum);
          std::copy_n(sum, channels_, &values_[node(int(x), int(y), top - 1 - i)]);
        }
      }
    }
  });
}

// Each node by itself, over the part of its way that is in the bounds.
void LightDepths::fill_lamp(const UnevenMedium& medium) {
  const float step = std::min({step_.x, step_.y, step_.z});
  parallel_for(nz_, [&](size_t z) {
    V3f P[MediumRays::capacity];
    MediumPoint point[MediumRays::capacity];
    for (size_t y = 0; y < ny_; ++y)
      for (size_t x = 0; x < nx_; ++x) {
        const V3f to = place_of(float(x), float(y), float(z));
        const float way = length(to - settings_.light);
        if (!(way > 0)) continue;
        const V3f d = (to - settings_.light) * (1 / way);
        float first = 0, last = way;
        for (int k = 0; k < 3; ++k) {
          if (d[k] == 0) continue;
          const float a = (bounds_.min[k] - settings_.light[k]) / d[k],
                      b = (bounds_.max[k] - settings_.light[k]) / d[k];
          first = std::max(first, std::min(a, b)), last = std::min(last, std::max(a, b));
        }
        if (!(last > first)) continue;
        const int n = std::clamp(int(std::ceil((last - first) / step)), 1, MediumRays::capacity);
        const float width = (last - first) / float(n);
        for (int i = 0; i < n; ++i)
          P[i] = settings_.light + d * (first + width * (float(i) + to_unit_float(hash(settings_.seed, x, y, z, i))));
        medium.coefficients(P, 0, n, point);
        float sum[3] = {0, 0, 0};
        for (int i = 0; i < n; ++i) add(point[i], width, sum);
        for (size_t c = 0; c < channels_; ++c) values_[node(int(x), int(y), int(z)) + c] = sum[c] / way;
      }
  });
}

RGB LightDepths::at(const V3f& P) const {
  const V3f in_frame(dot(P, frame_.s), dot(P, frame_.t), dot(P, frame_.n));
  const size_t count[3] = {nx_, ny_, nz_};
  int cell[3];
  float part[3];
  for (int k = 0; k < 3; ++k) {
    const float at = std::clamp((in_frame[k] - low_[k]) * per_step_[k], 0.0f, float(count[k] - 1));
    cell[k] = std::min(int(at), int(count[k]) - 2);
    part[k] = at - float(cell[k]);
  }
  const float scale = settings_.is_lamp ? length(P - settings_.light) : 1.0f;
  const auto value = [&](size_t c) {
    const float* const v = values_.data() + c;
    const auto row = [&](int y, int z) {
      const size_t a = node(cell[0], cell[1] + y, cell[2] + z);
      return v[a] + part[0] * (v[a + channels_] - v[a]);
    };
    const auto slice = [&](int z) { return row(0, z) + part[1] * (row(1, z) - row(0, z)); };
    return scale * (slice(0) + part[2] * (slice(1) - slice(0)));
  };
  if (channels_ == 1) return color_ * value(0);
  return {value(0), value(1), value(2)};
}

}  // namespace dapple::shafts
