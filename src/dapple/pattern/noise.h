// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "dapple/pattern/lane_math.h"

// Noise at one point, free of branches (see lane_math.h): the bodies of the vector kernels.
namespace dapple::pattern::lane {

namespace tables {
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

/// Entries i and i + 1 of the permutation (low and high half), so that one look-up serves two lattice points; twice
/// over, so that sums of two need no remainder.
constexpr auto pairs = [] {
  std::array<int32_t, 512> out{};
  for (uint32_t i = 0; i < 512; ++i) out[i] = permutation[i & 255] | permutation[(i + 1) & 255] << 16;
  return out;
}();
}  // namespace tables

DAPPLE_LANE float copy_sign_bit(float x, int32_t bit_31) {
  return std::bit_cast<float>(std::bit_cast<int32_t>(x) ^ bit_31);
}

/// Gradient `hash` (low 4 bits) times (x, y, z). Gradients point to the middles of a cube's edges, four of them twice;
/// their order is pbrt's.
DAPPLE_LANE float gradient_product(int32_t hash, float x, float y, float z) {
  const int32_t h = hash & 15;
  const bool xy = (h & 14) == 12;
  const float u = ((h < 8) | xy) ? x : y;
  const float v = ((h < 4) | xy) ? y : z;
  return copy_sign_bit(u, hash << 31) + copy_sign_bit(v, (hash << 30) & INT32_MIN);
}

/// 6 t^5 - 15 t^4 + 10 t^3: first and second derivative vanish at 0 and 1.
DAPPLE_LANE float fade(float t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}

/// Gradient noise (Perlin, Improving Noise, 2002): smooth, zero at integer points, about [-1, 1], repeating every 256.
/// The permutation is Perlin's and the choice of gradients pbrt's, so that patterns agree with pbrt's. 0 where not
/// finite.
DAPPLE_LANE float gradient_noise(float px, float py, float pz) {
  const bool finite = abs(px) + abs(py) + abs(pz) <= 3.40282347e38f;
  const float cx = choose(finite, px, 0), cy = choose(finite, py, 0), cz = choose(finite, pz, 0);
  const float fx = floor(cx), fy = floor(cy), fz = floor(cz);
  const float x = cx - fx, y = cy - fy, z = cz - fz;
  const auto cell = [](float f) { return static_cast<int32_t>(f - 256 * floor(f * (1.0f / 256))) & 255; };
  const int32_t k = cell(fz), j = cell(fy), low = 0xffff;
  const int32_t a = tables::pairs[static_cast<uint32_t>(cell(fx))];
  const int32_t a0 = tables::pairs[static_cast<uint32_t>((a & low) + j)];
  const int32_t a1 = tables::pairs[static_cast<uint32_t>((a >> 16) + j)];
  const int32_t h00 = tables::pairs[static_cast<uint32_t>((a0 & low) + k)];  // both corners along z at x, y
  const int32_t h01 = tables::pairs[static_cast<uint32_t>((a0 >> 16) + k)];
  const int32_t h10 = tables::pairs[static_cast<uint32_t>((a1 & low) + k)];
  const int32_t h11 = tables::pairs[static_cast<uint32_t>((a1 >> 16) + k)];
  const float u = fade(x), v = fade(y), w = fade(z);
  const float near = mix(mix(gradient_product(h00, x, y, z), gradient_product(h10, x - 1, y, z), u),
                         mix(gradient_product(h01, x, y - 1, z), gradient_product(h11, x - 1, y - 1, z), u), v);
  const float far =
      mix(mix(gradient_product(h00 >> 16, x, y, z - 1), gradient_product(h10 >> 16, x - 1, y, z - 1), u),
          mix(gradient_product(h01 >> 16, x, y - 1, z - 1), gradient_product(h11 >> 16, x - 1, y - 1, z - 1), u), v);
  return mix(near, far, w);
}

/// 32 random bits of a lattice point: multiply and shift rounds (constants of Wellons' lowbias32).
DAPPLE_LANE uint32_t lattice_hash(int32_t x, int32_t y, int32_t z) {
  uint32_t h = static_cast<uint32_t>(x) * 0x9e3779b1u ^ static_cast<uint32_t>(y) * 0x85ebca77u ^
               static_cast<uint32_t>(z) * 0xc2b2ae3du;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return h ^ (h >> 16);
}

/// [0, 1) of 10 bits.
DAPPLE_LANE float unit_of(uint32_t bits) {
  return static_cast<float>(static_cast<int32_t>(bits & 1023)) * (1.0f / 1024);
}

/// Beyond this lattices have no room between their points; coordinates are held there.
constexpr float lattice_bound = 1e6f;
DAPPLE_LANE float on_lattice(float x) {
  return x == x ? clamp(x, -lattice_bound, lattice_bound) : 0.0f;
}

/// One corner's part of simplex noise: (1/2 - r^2)^4 times the gradient's product.
DAPPLE_LANE float simplex_corner(int32_t i, int32_t j, int32_t k, float x, float y, float z) {
  const float t = max(0.5f - x * x - y * y - z * z, 0);
  return t * t * t * t * gradient_product(static_cast<int32_t>(lattice_hash(i, j, k) >> 8), x, y, z);
}

/// Simplex noise in space (Perlin, Noise Hardware, 2001): continuous with its first two derivatives, about [-1, 1],
/// zero at the images of integer points. The falloff radius is sqrt(1/2), which leaves no jumps between simplices.
DAPPLE_LANE float simplex_noise(float px, float py, float pz) {
  const float qx = on_lattice(px), qy = on_lattice(py), qz = on_lattice(pz);
  const float skew = (qx + qy + qz) * (1.0f / 3);
  const float fi = floor(qx + skew), fj = floor(qy + skew), fk = floor(qz + skew);
  const float unskew = (fi + fj + fk) * (1.0f / 6);
  const float x = qx - (fi - unskew), y = qy - (fj - unskew), z = qz - (fk - unskew);
  const int32_t xy = x >= y, yz = y >= z, xz = x >= z;
  // The order of x, y, z tells which axis is stepped along first and which second.
  const int32_t i1 = xy & xz, j1 = (1 - xy) & yz, k1 = (1 - xz) & (1 - yz);
  const int32_t i2 = xy | xz, j2 = (1 - xy) | yz, k2 = (1 - xz) | (1 - yz);
  const int32_t i = static_cast<int32_t>(fi), j = static_cast<int32_t>(fj), k = static_cast<int32_t>(fk);
  constexpr float g = 1.0f / 6;
  const auto f = [](int32_t n) { return static_cast<float>(n); };
  const float sum = simplex_corner(i, j, k, x, y, z) +
                    simplex_corner(i + i1, j + j1, k + k1, x - f(i1) + g, y - f(j1) + g, z - f(k1) + g) +
                    simplex_corner(i + i2, j + j2, k + k2, x - f(i2) + 2 * g, y - f(j2) + 2 * g, z - f(k2) + 2 * g) +
                    simplex_corner(i + 1, j + 1, k + 1, x - 1 + 3 * g, y - 1 + 3 * g, z - 1 + 3 * g);
  return 76 * sum;
}

/// How many octaves the footprint lets through, the squared length of which is width2: the finest has a wavelength of
/// two footprints.
DAPPLE_LANE float resolved_octaves(float width2, float octaves) {
  const float n = -1 - 0.5f * 1.44269504f * log(width2);
  return width2 > 0 ? clamp(n, 0, octaves) : octaves;
}

/// How much of octave `i` (0 is the first) is let through.
DAPPLE_LANE float octave_weight(float resolved, float i) {
  const float t = clamp((resolved - i - 0.3f) * 2.5f, 0, 1);
  return t * t * (3 - 2 * t);
}

constexpr float lacunarity = 1.99f;  ///< not 2, lest lattice points of all octaves fall together
// Over four million points. The first three: of gradient noise and its absolute value.
constexpr float noise_variance = 0.0716f, mean_absolute_noise = 0.218f, absolute_noise_variance = 0.0241f;
constexpr float simplex_variance = 0.150f;

/// 1 for even, -1 for odd cells.
DAPPLE_LANE float cell_sign(float floor_x) {
  return floor_x - 2 * floor(floor_x * 0.5f) == 0 ? 1.0f : -1.0f;
}
/// The periodic part of the second integral of the square wave.
DAPPLE_LANE float second_integral(float x) {
  const float f = floor(x), z = x - f;
  return cell_sign(f) * z * (z - 1) * 0.5f;
}

/// The square wave that is 1 on [0, 1), -1 on [1, 2) and so on, filtered by a tent of half-width r around x: exact for
/// any r >= 0. 0 where x is not finite or r above 1e6.
DAPPLE_LANE float square_wave(float x_or_nan, float r_or_nan) {
  const bool legal = abs(x_or_nan) <= 3.40282347e38f && r_or_nan < 1e6f;
  const float x = legal ? x_or_nan : 0.0f, r = legal ? r_or_nan : 0.0f;
  const bool wide = r > 0.5f;
  const float safe = wide ? r : 1.0f;
  const float of_wide =
      (second_integral(x + safe) - 2 * second_integral(x) + second_integral(x - safe)) / (safe * safe);
  // At most one edge is within reach; distances from it keep their digits however narrow the filter.
  const float edge = floor(x + 0.5f), u = x - edge, above = cell_sign(edge);
  const float side = u >= 0 ? above : -above;
  const float a = max(1 - divide(abs(u), r), 0);  // the tent's weight on the far side is a^2 / 2
  const float of_narrow = r > 0 ? side * (1 - a * a) : side;
  return legal ? (wide ? of_wide : of_narrow) : 0.0f;
}

}  // namespace dapple::pattern::lane
