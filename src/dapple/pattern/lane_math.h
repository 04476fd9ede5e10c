// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

/// Inlined for ever: code compiled for one instruction set must not be shared with another.
#define DAPPLE_LANE [[gnu::always_inline]] static inline

// Elementary functions without branches or calls, which compilers turn into vector code. Every one is a fixed sequence
// of IEEE operations: lanes of a vector, scalars, and all instruction sets give the same bits.
//
// Polynomials of exp, log, sin, cos and atan: Moshier, Cephes Mathematical Library (single precision). Errors against
// exact values, largest found by tests/shading/lane_math.cpp: exp 1.5, log 1.5, pow 1, atan2 3 units in the last place;
// sin and cos 1.2e-7, absolute, up to |x| = 1e8.
namespace dapple::pattern::lane {

/// c ? a : b, of values that are computed either way: compilers tend to turn `?` over long expressions into branches.
DAPPLE_LANE float choose(bool c, float a, float b) {
  const int32_t mask = -static_cast<int32_t>(c);
  return std::bit_cast<float>((std::bit_cast<int32_t>(a) & mask) | (std::bit_cast<int32_t>(b) & ~mask));
}
DAPPLE_LANE float abs(float x) {
  return __builtin_fabsf(x);
}
DAPPLE_LANE float floor(float x) {
  return __builtin_floorf(x);
}
DAPPLE_LANE float min(float a, float b) {
  return a < b ? a : b;
}
DAPPLE_LANE float max(float a, float b) {
  return a > b ? a : b;
}
DAPPLE_LANE float clamp(float x, float low, float high) {
  return min(max(x, low), high);
}
DAPPLE_LANE float fract(float x) {
  return x - floor(x);
}
/// 0 for negative x.
DAPPLE_LANE float sqrt(float x) {
  return __builtin_sqrtf(x > 0 ? x : 0.0f);
}
/// a / b, 0 for b = 0.
DAPPLE_LANE float divide(float a, float b) {
  const float q = a / (b == 0 ? 1.0f : b);
  return b == 0 ? 0.0f : q;
}
/// a - b floor(a / b), of b's sign; 0 for b = 0.
DAPPLE_LANE float modulo(float a, float b) {
  return a - b * floor(divide(a, b)) - (b == 0 ? a : 0.0f);
}
DAPPLE_LANE float mix(float a, float b, float t) {
  return a * (1 - t) + b * t;
}
/// 0 up to `low`, 1 from `high`, 3 t^2 - 2 t^3 between; a step at `low` where high <= low.
DAPPLE_LANE float smoothstep(float low, float high, float x) {
  const float step = x < low ? 0.0f : 1.0f;
  const float width = high - low;
  const float t = clamp((x - low) / (width > 0 ? width : 1.0f), 0, 1);
  return width > 0 ? t * t * (3 - 2 * t) : step;
}

/// 2^n for whole n in [-126, 127].
DAPPLE_LANE float power_of_two(int32_t n) {
  return std::bit_cast<float>((n + 127) << 23);
}
/// y 2^n for whole |n| <= 252, denormal and infinite results included.
DAPPLE_LANE float scale_by_power_of_two(float y, float n) {
  const int32_t k = static_cast<int32_t>(n == n ? n : 0.0f), half = k >> 1;
  return y * power_of_two(half) * power_of_two(k - half);
}

DAPPLE_LANE float exp(float x) {
  const float c = x < -105 ? -105.0f : x > 89 ? 89.0f : x;
  const float n = floor(c * 1.44269504f + 0.5f);
  const float r = c - n * 0.693359375f - n * -2.12194440e-4f;
  float p = 1.9875691500e-4f;
  p = p * r + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  return scale_by_power_of_two(p * r * r + r + 1, n);
}

/// x = m 2^e, m in [sqrt(1/2), sqrt(2)), for finite x > 0.
DAPPLE_LANE float split_exponent(float x, float* e) {
  const bool tiny = x < 1.17549435e-38f;
  const int32_t bits = std::bit_cast<int32_t>(tiny ? x * 16777216.0f : x);
  const float m = std::bit_cast<float>((bits & 0x7fffff) | 0x3f000000);  // [1/2, 1)
  const float exponent = static_cast<float>((bits >> 23) - 126) - (tiny ? 24.0f : 0.0f);
  const bool low = m < 0.707106781f;
  *e = exponent - (low ? 1.0f : 0.0f);
  return low ? m + m : m;
}

/// Natural logarithm; of x below the smallest normal number (zero and less included): that number's, -87.3.
DAPPLE_LANE float log(float x) {
  float e;
  const float f = split_exponent(clamp(x, 1.17549435e-38f, 3.40282347e38f), &e) - 1;
  const float z = f * f;
  float p = 7.0376836292e-2f;
  p = p * f - 1.1514610310e-1f;
  p = p * f + 1.1676998740e-1f;
  p = p * f - 1.2420140846e-1f;
  p = p * f + 1.4249322787e-1f;
  p = p * f - 1.6668057665e-1f;
  p = p * f + 2.0000714765e-1f;
  p = p * f - 2.4999993993e-1f;
  p = p * f + 3.3333331174e-1f;
  return f + (f * z * p + -2.12194440e-4f * e - 0.5f * z) + 0.693359375f * e;
}

/// a^b, in double precision inside. Of negative a as std::pow where b is whole, else 0; 0^b = 0 also for b < 0; a^0
/// = 1.
DAPPLE_LANE float pow(float a, float b) {
  const float magnitude = abs(a);
  float e;
  const double m = split_exponent(magnitude > 0 ? min(magnitude, 3.40282347e38f) : 1.0f, &e);
  const double t = (m - 1) / (m + 1), z = t * t;  // log(m) = 2 atanh(t)
  double series = 1.0 / 13;
  series = series * z + 1.0 / 11;
  series = series * z + 1.0 / 9;
  series = series * z + 1.0 / 7;
  series = series * z + 1.0 / 5;
  series = series * z + 1.0 / 3;
  const double log2 = e + (t + t * z * series) * (2 * 1.4426950408889634);
  const double exponent = log2 * b;
  const double bounded = exponent > -250 ? exponent : -250.0;
  const double c = bounded < 250 ? bounded : 250.0;
  const double n = __builtin_floor(c + 0.5), r = (c - n) * 0.6931471805599453;
  double p = 1.0 / 40320;
  p = p * r + 1.0 / 5040;
  p = p * r + 1.0 / 720;
  p = p * r + 1.0 / 120;
  p = p * r + 1.0 / 24;
  p = p * r + 1.0 / 6;
  p = p * r + 0.5;
  p = p * r + 1;
  p = p * r + 1;
  const float value = scale_by_power_of_two(static_cast<float>(p), static_cast<float>(n));
  const bool whole = floor(b) == b, odd = whole && floor(b * 0.5f) * 2 != b;
  const float of_negative = choose(odd, -value, choose(whole, value, 0));
  return choose(b == 0, 1, choose(magnitude > 0, choose(a < 0, of_negative, value), 0));
}

/// sin(x) for quadrant 0, cos(x) for quadrant 1. 0 or 1 for what is not finite or beyond 1e9.
DAPPLE_LANE float sine(float x, int32_t quadrant) {
  const double d = choose(abs(x) <= 1e9f, x, 0);
  const double q = __builtin_floor(d * 0.63661977236758138 + 0.5);
  const float r = static_cast<float>(d - q * 1.5707963267948966), z = r * r;
  const int32_t k = static_cast<int32_t>(q) + quadrant;
  const float s = ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f) * z * r + r;
  const float c =
      ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f) * z * z - 0.5f * z + 1;
  const float v = choose((k & 1) != 0, c, s);
  return std::bit_cast<float>(std::bit_cast<int32_t>(v) ^ ((k & 2) << 30));
}
DAPPLE_LANE float sin(float x) {
  return sine(x, 0);
}
DAPPLE_LANE float cos(float x) {
  return sine(x, 1);
}

/// In [-pi, pi]; 0 at the origin.
DAPPLE_LANE float atan2(float y, float x) {
  const float ax = abs(x), ay = abs(y);
  const bool steep = ay > ax;
  const float a = divide(steep ? ax : ay, steep ? ay : ax);
  const bool high = a > 0.414213562f;
  const float t = high ? (a - 1) / (a + 1) : a, z = t * t;
  const float p = ((8.05374449538e-2f * z - 1.38776856032e-1f) * z + 1.99777106478e-1f) * z - 3.33329491539e-1f;
  const float octant = (high ? 0.785398163f : 0.0f) + (p * z * t + t);
  const float quadrant = steep ? 1.57079633f - octant : octant;
  const float half = x < 0 ? 3.14159265f - quadrant : quadrant;
  return __builtin_copysignf(half, y);
}

}  // namespace dapple::pattern::lane
