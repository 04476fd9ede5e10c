// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/directions.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dapple/forest/half_range.h"

namespace dapple::forest {

PolarNodes PolarNodes::gauss(int n) {
  if (n < 1 || n > 64) throw std::invalid_argument("nodes per hemisphere must be from 1 to 64");
  QuadratureRule rule = gauss_legendre(n, 0, 1);
  return {std::move(rule.x), std::move(rule.w), {}};
}

PolarNodes PolarNodes::mobley() {
  PolarNodes p;
  for (int band = 0; band < 10; ++band) {
    const auto edge = [](int e) { return e == 0 ? 0 : e == 10 ? 1 : std::sin(std::numbers::pi / 180 * (10 * e - 5)); };
    const double low = edge(band), high = edge(band + 1);
    p.mu.push_back((low + high) / 2);
    p.w.push_back(high - low);
    p.bins.push_back(gauss_legendre(6, low, high));
    for (double& w : p.bins.back().w) w /= high - low;
  }
  return p;
}

Directions::Directions(const PolarNodes& nodes, int modes, std::optional<double> extra_mu)
    : nodes_(nodes), modes_(modes), extra_(extra_mu) {
  const auto add = [this](double mu) { kinks_.push_back(std::asin(mu)); };
  for (int i = 0; i < nodes_.size(); ++i) {
    if (nodes_.bins.empty())
      add(nodes_.mu[i]);
    else
      for (double mu : nodes_.bins[i].x) add(mu);
  }
  if (extra_) add(*extra_);
}

const FlakeTable& Directions::flakes(const LeafAngles& leaves, const QuadratureRule& normals) {
  const std::vector<double> key = leaves.discrete() >= 0 ? std::vector<double>{leaves.discrete()} : leaves.breaks();
  const auto [it, is_new] = tables_.try_emplace(key);
  FlakeTable& table = it->second;
  if (!is_new) return table;
  const size_t n = size(), count = normals.x.size(), stride = n * count;
  table.theta = normals.x;
  table.plus.assign(stride * modes_, 0);
  table.minus.assign(stride * modes_, 0);
  std::vector<double> plus(modes_), minus(modes_);
  for (size_t q = 0; q < count; ++q) {
    const double mu_n = std::cos(normals.x[q]);
    for (size_t i = 0; i < n; ++i) {
      const bool node = i < nodes_.mu.size();
      if (!node || nodes_.bins.empty()) {
        half_range_modes(node ? nodes_.mu[i] : *extra_, mu_n, modes_, &table.plus[q * n + i], &table.minus[q * n + i],
                         stride);
        continue;
      }
      const QuadratureRule& bin = nodes_.bins[i];
      for (size_t s = 0; s < bin.x.size(); ++s) {
        half_range_modes(bin.x[s], mu_n, modes_, plus.data(), minus.data(), 1);
        for (int m = 0; m < modes_; ++m) {
          table.plus[m * stride + q * n + i] += bin.w[s] * plus[m];
          table.minus[m * stride + q * n + i] += bin.w[s] * minus[m];
        }
      }
    }
  }
  return table;
}

}  // namespace dapple::forest
