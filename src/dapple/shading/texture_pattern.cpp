// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/texture_pattern.h"

#include <algorithm>
#include <cmath>

#include "dapple/shading/noise.h"

namespace dapple::shading {

namespace {

constexpr float filter_width = 1.5f;  // footprints on either side

/// 1 for even, -1 for odd cells.
float cell_sign(float floor_x) {
  return floor_x - 2 * std::floor(floor_x / 2) == 0 ? 1.0f : -1.0f;
}

/// The periodic part of the second integral of the square wave.
float second_integral(float x) {
  const float f = std::floor(x), z = x - f;
  return cell_sign(f) * z * (z - 1) / 2;
}

/// Weight of the second texture.
float checker(float sx, float sy, float sz) {
  return std::clamp(0.5f - 0.5f * sx * sy * sz, 0.0f, 1.0f);
}

float half_width(float dx, float dy) {
  return filter_width * std::max(std::abs(dx), std::abs(dy));
}

float plane_noise(float s, float t) {
  return gradient_noise({s, t, 0.5f});
}

bool in_dot(float s, float t) {
  constexpr float radius = 0.35f, shift = 0.5f - radius;
  const float cs = std::floor(s + 0.5f), ct = std::floor(t + 0.5f);
  if (!(plane_noise(cs + 0.5f, ct + 0.5f) > 0)) return false;
  const float ds = s - cs - shift * plane_noise(cs + 1.5f, ct + 2.8f);
  const float dt = t - ct - shift * plane_noise(cs + 4.5f, ct + 9.8f);
  return ds * ds + dt * dt < radius * radius;
}

RGB bezier(const RGB* p, float t) {
  const float u = 1 - t;
  return p[0] * (u * u * u) + p[1] * (3 * u * u * t) + p[2] * (3 * u * t * t) + p[3] * (t * t * t);
}

/// pbrt's marble colours over t in [0, 1].
RGB marble_color(float t) {
  static constexpr RGB light{.58f, .58f, .6f};
  static constexpr RGB colors[] = {
      light, light, light, {.5f, .5f, .5f}, {.6f, .59f, .58f}, light, light, {.2f, .2f, .33f}, light};
  constexpr int segments = 6;
  const float x = std::clamp(t, 0.0f, 1.0f) * segments;
  const int first = std::min(static_cast<int>(x), segments - 1);
  return 1.5f * bezier(colors + first, x - static_cast<float>(first));
}

}  // namespace

float filtered_square_wave(float x, float r) {
  if (!std::isfinite(x) || !(r < 1e6f)) return 0;
  if (r > 0.5f) return (second_integral(x + r) - 2 * second_integral(x) + second_integral(x - r)) / (r * r);
  // At most one edge is within reach; distances from it keep their digits however narrow the filter.
  const float edge = std::round(x), u = x - edge;
  const float above = cell_sign(edge);  // the wave to the right of the edge
  if (std::abs(u) >= r) return u >= 0 ? above : -above;
  const float a = 1 - std::abs(u) / r, smaller = 0.5f * a * a;  // the tent's weight on the far side
  return u >= 0 ? above * (1 - 2 * smaller) : -above * (1 - 2 * smaller);
}

template <class T>
void CheckerboardTexture<T>::evaluate(const ShadingPoints& points, T* out) const {
  float w[ShadingPoints::capacity];
  if (mapping3_) {
    for (int i = 0; i < points.count; ++i) {
      const TexturePoint3 q = mapping3_->map(points, i);
      w[i] = checker(filtered_square_wave(q.p.x, half_width(q.dpdx.x, q.dpdy.x)),
                     filtered_square_wave(q.p.y, half_width(q.dpdx.y, q.dpdy.y)),
                     filtered_square_wave(q.p.z, half_width(q.dpdx.z, q.dpdy.z)));
    }
  } else {
    TextureCoordinates2 c;
    mapping2_->map(points, &c);
    for (int i = 0; i < points.count; ++i)
      w[i] = checker(filtered_square_wave(c.s[i], half_width(c.dsdx[i], c.dsdy[i])),
                     filtered_square_wave(c.t[i], half_width(c.dtdx[i], c.dtdy[i])), 1);
  }
  evaluate_blend(points, *a_, *b_, w, out);
}

template <class T>
void DotsTexture<T>::evaluate(const ShadingPoints& points, T* out) const {
  TextureCoordinates2 c;
  mapping_->map(points, &c);
  float w[ShadingPoints::capacity];
  for (int i = 0; i < points.count; ++i) w[i] = in_dot(c.s[i], c.t[i]) ? 1.0f : 0.0f;
  evaluate_blend(points, *outside_, *inside_, w, out);
}

template class CheckerboardTexture<float>;
template class CheckerboardTexture<RGB>;
template class DotsTexture<float>;
template class DotsTexture<RGB>;

void FbmTexture::evaluate(const ShadingPoints& points, float* out) const {
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping_.map(points, i);
    out[i] = fbm(q.p, q.dpdx, q.dpdy, omega_, octaves_);
  }
}

void WrinkledTexture::evaluate(const ShadingPoints& points, float* out) const {
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping_.map(points, i);
    out[i] = turbulence(q.p, q.dpdx, q.dpdy, omega_, octaves_);
  }
}

void WindyTexture::evaluate(const ShadingPoints& points, float* out) const {
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping_.map(points, i);
    const float wind = fbm(q.p * 0.1f, q.dpdx * 0.1f, q.dpdy * 0.1f, 0.5f, 3);
    out[i] = std::abs(wind) * fbm(q.p, q.dpdx, q.dpdy, 0.5f, 6);
  }
}

void MarbleTexture::evaluate(const ShadingPoints& points, RGB* out) const {
  for (int i = 0; i < points.count; ++i) {
    const TexturePoint3 q = mapping_.map(points, i);
    const V3f p = q.p * scale_;
    const float layer = p.y + variation_ * fbm(p, q.dpdx * scale_, q.dpdy * scale_, omega_, octaves_);
    out[i] = marble_color(0.5f + 0.5f * std::sin(layer));
  }
}

}  // namespace dapple::shading
