// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/sobol.h"

namespace dapple {
inline namespace numeric {

void sample_1d(const uint32_t* __restrict pixel_seeds, const uint32_t* __restrict indices, uint32_t dimension, int n,
               float* __restrict out) {
  const uint32_t key = sobol::dimension_key(dimension);
  for (int i = 0; i < n; ++i) {
    const sobol::Seeds s(pixel_seeds[i], key);
    out[i] = sobol::coordinate_x(sobol::shuffled(indices[i], s), s);
  }
}

void sample_2d(const uint32_t* __restrict pixel_seeds, const uint32_t* __restrict indices, uint32_t dimension, int n,
               float* __restrict x, float* __restrict y) {
  const uint32_t key = sobol::dimension_key(dimension);
  for (int i = 0; i < n; ++i) {
    const sobol::Seeds s(pixel_seeds[i], key);
    const uint32_t place = sobol::shuffled(indices[i], s);
    x[i] = sobol::coordinate_x(place, s);
    y[i] = sobol::coordinate_y(place, s);
  }
}

}  // namespace numeric
}  // namespace dapple
