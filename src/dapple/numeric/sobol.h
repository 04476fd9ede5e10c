// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "dapple/base/hash.h"
#include "dapple/base/vec.h"

namespace dapple {
inline namespace numeric {

// Low-discrepancy samples without state: a sample is a pure function of (pixel seed, sample index, dimension).
//
// Each dimension number names an independent set of points in the unit interval or square, of its own for every pixel:
// a Sobol' (0,2)-sequence whose order is shuffled and whose coordinates are scrambled, all by Owen's nested uniform
// scrambling (Burley 2020, "Practical Hash-based Owen Scrambling"). So, of one pixel and one dimension, any b^k samples
// whose indices begin at a multiple of b^k (b = 2) put exactly one point into every elementary interval of area b^-k,
// and different dimensions or pixels are uncorrelated. Integer arithmetic without tables or branches: the loops over
// samples vectorise, and the batch functions return the bits of the scalar ones.
//
// Use each dimension number once, either for one coordinate or for a pair: sample_1d(.., d) is the x of sample_2d(..,
// d).

/// A key for all samples of a pixel (or of anything else that has two coordinates).
constexpr uint32_t pixel_seed(int32_t x, int32_t y, uint64_t seed) {
  return static_cast<uint32_t>(hash(seed, static_cast<uint32_t>(x), static_cast<uint32_t>(y)) >> 32);
}

namespace sobol {

constexpr uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/// A bijective 32-bit mixer of low bias (constants: C. Wellons' search, "lowbias32").
constexpr uint32_t mix32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/// Nested uniform scrambling of a number whose digits run from the least significant bit: a bit of the result depends
/// on the bits of x at and below its place only (Laine & Karras 2011, with the constants of N. Vegdahl's 2021 search).
constexpr uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// Second dimension of the Sobol' sequence, digits from the least significant bit, of index i: the product with
/// Pascal's triangle modulo 2. By Lucas' theorem the matrix is a fivefold Kronecker product of [1 1; 0 1], one step for
/// each factor.
constexpr uint32_t pascal(uint32_t i) {
  i ^= (i >> 1) & 0x55555555u;
  i ^= (i >> 2) & 0x33333333u;
  i ^= (i >> 4) & 0x0f0f0f0fu;
  i ^= (i >> 8) & 0x00ff00ffu;
  i ^= i >> 16;
  return i;
}

constexpr uint32_t dimension_key(uint32_t dimension) {
  return mix32(dimension * 0x9e3779b9u + 0x7f4a7c15u);
}

/// The 24 digits a float holds; never reaches 1.
constexpr float to_float(uint32_t digits) {
  return static_cast<float>(static_cast<int32_t>(digits >> 8)) * 0x1p-24f;
}

struct Seeds {
  uint32_t order, x, y;
  constexpr Seeds(uint32_t pixel, uint32_t key)
      : order(mix32(pixel ^ key)), x(mix32(order + 0x9e3779b9u)), y(mix32(order + 0x3c6ef372u)) {}
};

/// Place of sample `index` in the shuffled order.
constexpr uint32_t shuffled(uint32_t index, const Seeds& s) {
  return reverse_bits(scramble_reversed(reverse_bits(index), s.order));
}
constexpr float coordinate_x(uint32_t place, const Seeds& s) {
  return to_float(reverse_bits(scramble_reversed(place, s.x)));
}
constexpr float coordinate_y(uint32_t place, const Seeds& s) {
  return to_float(reverse_bits(scramble_reversed(pascal(place), s.y)));
}

}  // namespace sobol

/// A number in [0, one_minus_epsilon].
constexpr float sample_1d(uint32_t pixel_seed, uint32_t index, uint32_t dimension) {
  const sobol::Seeds s(pixel_seed, sobol::dimension_key(dimension));
  return sobol::coordinate_x(sobol::shuffled(index, s), s);
}

/// A point of the unit square, each coordinate in [0, one_minus_epsilon].
inline V2f sample_2d(uint32_t pixel_seed, uint32_t index, uint32_t dimension) {
  const sobol::Seeds s(pixel_seed, sobol::dimension_key(dimension));
  const uint32_t place = sobol::shuffled(index, s);
  return {sobol::coordinate_x(place, s), sobol::coordinate_y(place, s)};
}

/// Which sample of which set a camera sample is. Pixels of an aligned square share a set, in Z order, and each has an
/// aligned part of it: so not only a pixel's samples are a net, but those of 2 x 2, 4 x 4 .. pixels together, and the
/// mean of neighbours is less noisy than that of pixels which choose by themselves (Ahmed & Wonka 2020, "Screen-Space
/// Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
class PixelSets {
 public:
  struct Sample {
    uint32_t seed, index;  ///< pixel_seed and index of sample_1d and sample_2d
  };
  /// From so many samples on, each pixel has a set of its own.
  static constexpr uint32_t most_samples = 1u << 18;

  /// `samples`: of a pixel, more than 0. More than that may be drawn: each further `samples`, rounded up to a power of
  /// 2, are independent of those before.
  constexpr PixelSets(uint32_t samples, uint64_t seed)
      : seed_(seed),
        sample_bits_(std::min(most_bits, int(std::bit_width(samples - 1)))),
        pixel_bits_(std::min(most_pixel_bits, (most_bits - sample_bits_) / 2)) {}

  constexpr Sample at(uint32_t x, uint32_t y, uint32_t sample) const {
    const uint32_t in_square = (1u << pixel_bits_) - 1, in_pixel = (1u << sample_bits_) - 1;
    const uint32_t place = spread_bits(x & in_square) | spread_bits(y & in_square) << 1;
    return {pixel_seed(int32_t(x >> pixel_bits_), int32_t(y >> pixel_bits_), hash(seed_, sample >> sample_bits_)),
            place << sample_bits_ | (sample & in_pixel)};
  }
  /// Pixels along the side of a square that shares a set.
  constexpr int side() const { return 1 << pixel_bits_; }

 private:
  static constexpr int most_bits =
      std::bit_width(most_samples) - 1;  // of an index: users number several samples by each
  static constexpr int most_pixel_bits = 6;

  static constexpr uint32_t spread_bits(uint32_t x) {
    x = (x | x << 4) & 0x0f0fu;
    x = (x | x << 2) & 0x3333u;
    return (x | x << 1) & 0x5555u;
  }

  uint64_t seed_;
  int sample_bits_, pixel_bits_;
};

/// out[i] = sample_1d(pixel_seeds[i], indices[i], dimension) for i in [0, n). Arrays must not overlap.
void sample_1d(const uint32_t* pixel_seeds, const uint32_t* indices, uint32_t dimension, int n, float* out);

/// (x[i], y[i]) = sample_2d(pixel_seeds[i], indices[i], dimension) for i in [0, n). Arrays must not overlap.
void sample_2d(const uint32_t* pixel_seeds, const uint32_t* indices, uint32_t dimension, int n, float* x, float* y);

}  // namespace numeric
}  // namespace dapple
