// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/half_space.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/quadrature.h"

namespace dapple {
inline namespace numeric {

namespace {

constexpr int table_steps = 128;

// Cosines inside the medium, split where total reflection ends: the boundary's transmittance has a square root there.
QuadratureRule inside_cosines(double eta) {
  if (eta <= 1) return gauss_legendre(48, 0, 1);
  const double critical = std::sqrt(1 - 1 / (eta * eta));
  QuadratureRule rule = gauss_legendre(24, 0, critical);
  // x = critical + (1 - critical) s^2 undoes the square root.
  const QuadratureRule s = gauss_legendre(24, 0, 1);
  for (size_t i = 0; i < s.x.size(); ++i) {
    rule.x.push_back(critical + (1 - critical) * s.x[i] * s.x[i]);
    rule.w.push_back(2 * (1 - critical) * s.x[i] * s.w[i]);
  }
  return rule;
}

// Chandrasekhar's function for isotropic scattering, by iteration of 1 / H = sqrt(1 - a) + a / 2 int mu' H(mu') / (mu +
// mu') dmu'.
Eigen::VectorXd h_function(double albedo, const QuadratureRule& rule) {
  const int n = int(rule.x.size());
  Eigen::VectorXd H = Eigen::VectorXd::Ones(n);
  for (int step = 0; step < 1000; ++step) {
    Eigen::VectorXd next(n);
    for (int i = 0; i < n; ++i) {
      double sum = 0;
      for (int j = 0; j < n; ++j)
        sum += rule.w[size_t(j)] * rule.x[size_t(j)] * H[j] / (rule.x[size_t(i)] + rule.x[size_t(j)]);
      next[i] = 1 / (std::sqrt(1 - albedo) + albedo / 2 * sum);
    }
    const double change = (next - H).cwiseAbs().maxCoeff();
    H = (next + H) / 2;  // plain iteration swings about the solution
    if (change < 1e-10) break;
  }
  return H;
}

}  // namespace

double half_space_reflectance(double albedo, double eta) {
  albedo = std::clamp(albedo, 0.0, 1.0);
  if (albedo == 0) return 0;
  if (albedo == 1) return 1;
  const QuadratureRule rule = inside_cosines(eta);
  const int n = int(rule.x.size());
  const Eigen::VectorXd H = h_function(albedo, rule);
  Eigen::VectorXd transmitted(n), entered(n);
  for (int i = 0; i < n; ++i) entered[i] = transmitted[i] = 1 - fresnel_dielectric(rule.x[size_t(i)], 1 / eta);
  // up = K (entered + internal reflectance * up), K the reflection function of the medium alone.
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd source = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double mu = rule.x[size_t(i)], nu = rule.x[size_t(j)];
      const double K = rule.w[size_t(j)] * albedo / 2 * H[i] * H[j] * nu / (mu + nu);
      system(i, j) -= K * (1 - transmitted[j]);
      source[i] += K * entered[j];
    }
  const Eigen::VectorXd up = system.partialPivLu().solve(source);
  double in = 0, out = 0;
  for (int i = 0; i < n; ++i) {
    const double weight = rule.w[size_t(i)] * rule.x[size_t(i)];
    in += weight * entered[i];
    out += weight * transmitted[i] * up[i];
  }
  return std::clamp(out / in, 0.0, 1.0);
}

HalfSpaceTable::HalfSpaceTable(double eta) : reflectance_(table_steps + 1) {
  for (int i = 0; i <= table_steps; ++i) {
    const double x = double(i) / table_steps;
    reflectance_[size_t(i)] = float(half_space_reflectance(1 - x * x, eta));
  }
  for (int i = table_steps; i > 0; --i)
    reflectance_[size_t(i - 1)] = std::max(reflectance_[size_t(i - 1)], reflectance_[size_t(i)]);
}

float HalfSpaceTable::reflectance(float albedo) const {
  const float x = std::sqrt(1 - std::clamp(albedo, 0.0f, 1.0f)) * table_steps;
  const size_t i = std::min(size_t(x), size_t(table_steps - 1));
  const float f = x - float(i);
  return reflectance_[i] * (1 - f) + reflectance_[i + 1] * f;
}

float HalfSpaceTable::albedo(float reflectance) const {
  const float r = std::clamp(reflectance, 0.0f, 1.0f);
  const auto after =
      std::lower_bound(reflectance_.begin() + 1, reflectance_.end(), r, [](float a, float b) { return a > b; });
  if (after == reflectance_.end()) return 0;
  const size_t i = size_t(after - reflectance_.begin()) - 1;
  const float step = reflectance_[i] - reflectance_[i + 1];
  const float f = step > 0 ? std::clamp((reflectance_[i] - r) / step, 0.0f, 1.0f) : 0;
  const float x = (float(i) + f) / table_steps;
  return 1 - x * x;
}

}  // namespace numeric
}  // namespace dapple
