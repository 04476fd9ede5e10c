// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace dapple::shading {

namespace {

// The permutation of Perlin's reference implementation (2002).
constexpr std::array<uint8_t, 256> permutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,  69,  142,
    8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,  94,  252, 219, 203,
    117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136, 171, 168, 68,  175, 74,  165,
    71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122, 60,  211, 133, 230, 220, 105, 92,  41,
    55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161, 1,   216, 80,  73,  209, 76,  132, 187, 208, 89,
    18,  169, 200, 196, 135, 130, 116, 188, 159, 86,  164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250,
    124, 123, 5,   202, 38,  147, 118, 126, 255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189,
    28,  42,  223, 183, 170, 213, 119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,
    129, 22,  39,  253, 19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,
    242, 193, 238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,  222, 114,
    67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// Towards the middles of a cube's edges, four of them twice.
constexpr int8_t gradients[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                     {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                     {1, 1, 0},  {-1, 1, 0},  {0, 1, -1}, {0, -1, -1}};

int permute(int i) {
  return permutation[static_cast<size_t>(i & 255)];
}

float corner(int x, int y, int z, float dx, float dy, float dz) {
  const int8_t* g = gradients[permute(permute(permute(x) + y) + z) & 15];
  return static_cast<float>(g[0]) * dx + static_cast<float>(g[1]) * dy + static_cast<float>(g[2]) * dz;
}

/// 6 t^5 - 15 t^4 + 10 t^3: first and second derivative vanish at 0 and 1.
float fade(float t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/// Splits v into the cell modulo the period and the place in it.
int cell(float v, float* fraction) {
  const float f = std::floor(v);
  *fraction = v - f;
  return static_cast<int>(f - 256 * std::floor(f / 256));
}

float smooth_step(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

constexpr float lacunarity = 1.99f;  // not 2, lest lattice points of all octaves fall together
constexpr float mean_absolute_noise = 0.2f;

/// How many octaves the footprint lets through: the finest has a wavelength of two footprints.
float resolved_octaves(const V3f& dpdx, const V3f& dpdy, int octaves) {
  const float width2 = std::max(length2(dpdx), length2(dpdy));
  const float n = width2 > 0 ? -1 - 0.5f * std::log2(width2) : infinity;
  return std::clamp(n, 0.0f, static_cast<float>(octaves));
}

}  // namespace

float gradient_noise(const V3f& p) {
  if (!is_finite(p)) return 0;
  float x, y, z;
  const int i = cell(p.x, &x), j = cell(p.y, &y), k = cell(p.z, &z);
  const float u = fade(x), v = fade(y), w = fade(z);
  const auto edge = [&](int dj, int dk) {
    const float dy = y - static_cast<float>(dj), dz = z - static_cast<float>(dk);
    return lerp(u, corner(i, j + dj, k + dk, x, dy, dz), corner(i + 1, j + dj, k + dk, x - 1, dy, dz));
  };
  return lerp(w, lerp(v, edge(0, 0), edge(1, 0)), lerp(v, edge(0, 1), edge(1, 1)));
}

float fbm(const V3f& p, const V3f& dpdx, const V3f& dpdy, float omega, int octaves) {
  const float n = resolved_octaves(dpdx, dpdy, octaves);
  const int whole = static_cast<int>(n);
  float sum = 0, frequency = 1, amplitude = 1;
  for (int i = 0; i < whole; ++i) {
    sum += amplitude * gradient_noise(p * frequency);
    frequency *= lacunarity;
    amplitude *= omega;
  }
  return sum + amplitude * smooth_step(0.3f, 0.7f, n - static_cast<float>(whole)) * gradient_noise(p * frequency);
}

float turbulence(const V3f& p, const V3f& dpdx, const V3f& dpdy, float omega, int octaves) {
  const float n = resolved_octaves(dpdx, dpdy, octaves);
  const int whole = static_cast<int>(n);
  float sum = 0, frequency = 1, amplitude = 1;
  for (int i = 0; i < whole; ++i) {
    sum += amplitude * std::abs(gradient_noise(p * frequency));
    frequency *= lacunarity;
    amplitude *= omega;
  }
  if (whole == octaves) return sum;
  const float faded = smooth_step(0.3f, 0.7f, n - static_cast<float>(whole));
  sum += amplitude * lerp(faded, mean_absolute_noise, std::abs(gradient_noise(p * frequency)));
  for (int i = whole + 1; i < octaves; ++i) {
    amplitude *= omega;
    sum += amplitude * mean_absolute_noise;
  }
  return sum;
}

}  // namespace dapple::shading
