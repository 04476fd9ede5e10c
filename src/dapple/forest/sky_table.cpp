// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sky_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dapple::forest {

double SkyTable::at(double mu, double phi, int w) const {
  constexpr double pi_d = std::numbers::pi;
  const double turn = phi / (2 * pi_d);
  // A cosine may be above one by a rounding.
  const double y = std::clamp(std::acos(std::min(mu, 1.0)) / (pi_d / 2) * rows - 0.5, 0.0, rows - 1.0),
               x = (turn - std::floor(turn)) * columns - 0.5;
  const int y0 = std::min(int(y), rows - 2), x0 = int(std::floor(x));
  const double fy = y - y0, fx = x - x0;
  const auto cell = [&](int row, int column) {
    return values[(size_t(row) * size_t(columns) + size_t((column + columns) % columns)) * size_t(channels) +
                  size_t(channels == 1 ? 0 : w)];
  };
  return (1 - fy) * ((1 - fx) * cell(y0, x0) + fx * cell(y0, x0 + 1)) +
         fy * ((1 - fx) * cell(y0 + 1, x0) + fx * cell(y0 + 1, x0 + 1));
}

}  // namespace dapple::forest
