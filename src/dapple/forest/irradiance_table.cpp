// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/irradiance_table.h"

#include <cmath>
#include <numbers>

#include "dapple/numeric/quadrature.h"

namespace dapple::forest {

namespace {

constexpr int even_terms = 6;

// Orthogonal polynomials of degrees 0 and 2, which both sides share, then those of degree 1, of which they have
// opposite signs.
template <class T>
void harmonics(T x, T y, T z, T* out) {
  out[0] = 1;
  out[1] = x * y;
  out[2] = y * z;
  out[3] = x * z;
  out[4] = x * x - y * y;
  out[5] = 3 * z * z - 1;
  out[6] = x;
  out[7] = y;
  out[8] = z;
}

// Integrals of their squares over the sphere, divided by 4 pi.
constexpr double norms[] = {1, 1 / 15.0, 1 / 15.0, 1 / 15.0, 4 / 15.0, 4 / 5.0, 1 / 3.0, 1 / 3.0, 1 / 3.0};

}  // namespace

void IrradianceTable::add(const CanopySolver& solver, const Field& field, double beam_azimuth, RGB weight,
                          CanopySolver::From from) {
  constexpr int turns = 16;
  const QuadratureRule rule = gauss_legendre(16);
  for (size_t i = 0; i < rule.x.size(); ++i)
    for (int j = 0; j < turns; ++j) {
      const double phi = 2 * std::numbers::pi * (j + 0.5) / turns, sine = std::sqrt(1 - rule.x[i] * rule.x[i]);
      const std::vector<double> E = solver.irradiance(field, rule.x[i], phi - beam_azimuth, from);
      double y[term_count];
      harmonics(sine * std::cos(phi), sine * std::sin(phi), rule.x[i], y);
      for (size_t t = 0; t < term_count; ++t) {
        const double share = y[t] / norms[t] * rule.w[i] / (2 * turns);
        for (size_t l = 0; l < heights_.size(); ++l)
          for (size_t c = 0; c < 3; ++c) terms_[l][t][c] += float(share * weight[int(c)] * E[l * 3 + c]);
      }
    }
}

void IrradianceTable::add(size_t level, const IrradianceTable& other, RGB weight) {
  for (size_t t = 0; t < term_count; ++t)
    for (size_t c = 0; c < 3; ++c) terms_[level][t][c] += weight[int(c)] * other.terms_[level][t][c];
}

void IrradianceTable::add(size_t level, RGB irradiance) {
  for (size_t c = 0; c < 3; ++c) terms_[level][0][c] += irradiance[int(c)];
}

IrradianceTable IrradianceTable::middles() const {
  std::vector<double> heights;
  for (size_t l = 0; l + 1 < heights_.size(); ++l) heights.push_back(0.5 * (heights_[l] + heights_[l + 1]));
  IrradianceTable table(heights);
  for (size_t l = 0; l < heights.size(); ++l)
    for (size_t t = 0; t < term_count; ++t)
      for (size_t c = 0; c < 3; ++c) table.terms_[l][t][c] = 0.5f * (terms_[l][t][c] + terms_[l + 1][t][c]);
  return table;
}

IrradianceTable::Sides IrradianceTable::at(float z, const V3f& n) const {
  const auto above = std::upper_bound(heights_.begin(), heights_.end(), double(z));
  const size_t top = size_t(above - heights_.begin()), high = std::min(top, heights_.size() - 1),
               low = top == 0 ? 0 : top - 1;
  const float f = low == high ? 0 : float((double(z) - heights_[low]) / (heights_[high] - heights_[low]));
  float y[term_count];
  harmonics(n.x, n.y, n.z, y);
  float even[3] = {}, odd[3] = {};
  for (int t = 0; t < term_count; ++t) {
    float* sum = t < even_terms ? even : odd;
    for (size_t c = 0; c < 3; ++c) sum[c] += y[t] * lerp(f, terms_[low][size_t(t)][c], terms_[high][size_t(t)][c]);
  }
  Sides s;
  for (int c = 0; c < 3; ++c) {
    s.front[c] = std::max(0.0f, even[c] + odd[c]);
    s.behind[c] = std::max(0.0f, even[c] - odd[c]);
  }
  return s;
}

}  // namespace dapple::forest
