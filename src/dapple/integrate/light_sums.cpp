// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/light_sums.h"

namespace dapple::integrate {

void share_out(const RGB& sum, std::span<RGB> parts) {
  for (int c = 0; c < 3; ++c) {
    float all = 0;
    for (const RGB& part : parts) all += part[c];
    const float scale = sum[c] / all;
    const bool shared = all > 0 && scale < infinity;
    for (RGB& part : parts) part[c] = shared ? part[c] * scale : 0;
    if (!shared) parts[0][c] = sum[c];
  }
}

void LightSums::clear_parts(int i, int count) {
  std::fill_n(part(i), count * groups_, RGB());
}

void LightSums::add_parts(int i, const RGB& weight, const RGB* parts) {
  for (int g = 0; g < groups_; ++g) part(i)[g] += weight * parts[g];
}

void LightSums::scale_parts(int i, const RGB& by) {
  for (int g = 0; g < groups_; ++g) part(i)[g] *= by;
}

}  // namespace dapple::integrate
