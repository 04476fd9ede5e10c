// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace dapple {
inline namespace base {

/// Linear RGB, Rec.709 primaries, D65 white. Used for radiance (W m^-2 sr^-1), reflectance and transmittance alike.
struct RGB {
  float r = 0, g = 0, b = 0;

  constexpr RGB() = default;
  constexpr explicit RGB(float v) : r(v), g(v), b(v) {}
  constexpr RGB(float r_, float g_, float b_) : r(r_), g(g_), b(b_) {}

  constexpr float operator[](int i) const { return i == 0 ? r : i == 1 ? g : b; }
  constexpr float& operator[](int i) { return i == 0 ? r : i == 1 ? g : b; }

  constexpr RGB& operator+=(RGB o) { return r += o.r, g += o.g, b += o.b, *this; }
  constexpr RGB& operator-=(RGB o) { return r -= o.r, g -= o.g, b -= o.b, *this; }
  constexpr RGB& operator*=(RGB o) { return r *= o.r, g *= o.g, b *= o.b, *this; }
  constexpr RGB& operator*=(float s) { return r *= s, g *= s, b *= s, *this; }

  friend constexpr RGB operator+(RGB a, RGB b) { return a += b; }
  friend constexpr RGB operator-(RGB a, RGB b) { return a -= b; }
  friend constexpr RGB operator*(RGB a, RGB b) { return a *= b; }
  friend constexpr RGB operator*(RGB a, float s) { return a *= s; }
  friend constexpr RGB operator*(float s, RGB a) { return a *= s; }
  friend constexpr RGB operator/(RGB a, RGB b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }
  friend constexpr RGB operator/(RGB a, float s) { return a *= 1.0f / s; }
  friend constexpr bool operator==(const RGB&, const RGB&) = default;

  constexpr bool is_black() const { return r == 0 && g == 0 && b == 0; }
  constexpr float max() const { return std::max(r, std::max(g, b)); }
  constexpr float min() const { return std::min(r, std::min(g, b)); }
  constexpr float average() const { return (r + g + b) * (1.0f / 3.0f); }
  /// CIE Y of the colour, Rec.709 weights.
  constexpr float luminance() const { return 0.2126f * r + 0.7152f * g + 0.0722f * b; }
  bool is_finite() const { return std::isfinite(r) && std::isfinite(g) && std::isfinite(b); }
};

inline RGB exp(RGB c) {
  return {std::exp(c.r), std::exp(c.g), std::exp(c.b)};
}
inline RGB sqrt(RGB c) {
  return {std::sqrt(c.r), std::sqrt(c.g), std::sqrt(c.b)};
}
inline RGB clamp(RGB c, float lo, float hi) {
  return {std::clamp(c.r, lo, hi), std::clamp(c.g, lo, hi), std::clamp(c.b, lo, hi)};
}
constexpr RGB lerp(float t, RGB a, RGB b) {
  return a * (1 - t) + b * t;
}

}  // namespace base
}  // namespace dapple
