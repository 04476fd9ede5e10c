// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/half_space.h"

#include <Eigen/Dense>
#include <algorithm>

#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/quadrature.h"

namespace dapple {
inline namespace numeric {

namespace {

constexpr int table_steps = 128;
constexpr int half_nodes = 16;
constexpr int moments = half_nodes;  // of the phase function: what the nodes integrate exactly

// Cosines inside the medium, split where total reflection ends: the boundary's transmittance has a square root there.
QuadratureRule inside_cosines(double eta) {
  if (eta <= 1) return gauss_legendre(2 * half_nodes, 0, 1);
  const double critical = std::sqrt(1 - 1 / (eta * eta));
  QuadratureRule rule = gauss_legendre(half_nodes, 0, critical);
  // x = critical + (1 - critical) s^2 undoes the square root.
  const QuadratureRule s = gauss_legendre(half_nodes, 0, 1);
  for (size_t i = 0; i < s.x.size(); ++i) {
    rule.x.push_back(critical + (1 - critical) * s.x[i] * s.x[i]);
    rule.w.push_back(2 * (1 - critical) * s.x[i] * s.w[i]);
  }
  return rule;
}

// Reflection of the medium alone, between radiances scaled by sqrt(w mu), in which it is symmetric. With s and d the
// sum and difference of what goes down and up, mu s' = -A d and mu d' = -B s, where A and B hold the odd and even
// moments: solutions exp(-k tau) with k^2 of the product.
Eigen::MatrixXd reflection(double albedo, double g, const QuadratureRule& rule) {
  const int n = int(rule.x.size());
  const double peak = std::pow(g, moments), scaled = albedo * (1 - peak) / (1 - albedo * peak);
  Eigen::MatrixXd odd = Eigen::MatrixXd::Identity(n, n), even = odd;
  Eigen::VectorXd x(n), weight(n), before = Eigen::VectorXd::Zero(n), legendre = Eigen::VectorXd::Ones(n);
  for (int i = 0; i < n; ++i) x[i] = rule.x[size_t(i)], weight[i] = std::sqrt(rule.w[size_t(i)]);
  double moment = 1;
  for (int l = 0; l < moments; ++l) {
    const Eigen::VectorXd p = legendre.cwiseProduct(weight);
    (l % 2 ? odd : even) -= (scaled * (2 * l + 1) * (moment - peak) / (1 - peak)) * p * p.transpose();
    const Eigen::VectorXd next = ((2 * l + 1) * x.cwiseProduct(legendre) - l * before) / (l + 1);
    before = legendre, legendre = next;
    moment *= g;
  }
  const Eigen::VectorXd root = x.cwiseSqrt().cwiseInverse();
  odd = root.asDiagonal() * odd * root.asDiagonal();
  even = root.asDiagonal() * even * root.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(odd);
  const Eigen::MatrixXd lower = cholesky.matrixL();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(lower.transpose() * even * lower);
  const Eigen::VectorXd k = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::MatrixXd sum = lower * solver.eigenvectors(),
                        difference = lower.transpose().triangularView<Eigen::Upper>().solve(solver.eigenvectors() *
                                                                                            k.asDiagonal());
  return (sum + difference).transpose().partialPivLu().solve((sum - difference).transpose()).transpose();
}

// Least squares, weighted as what leaves is.
std::array<double, 3> fitted(const QuadratureRule& rule, const Eigen::VectorXd& transmitted, const Eigen::VectorXd& up,
                             double eta) {
  Eigen::Matrix3d system = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), mean = right;
  for (size_t i = 0; i < rule.x.size(); ++i) {
    const double mu = rule.x[i], weight = rule.w[i] * mu * transmitted[int(i)];
    const Eigen::Vector3d terms(1, mu, mu * std::log((1 + mu) / mu));
    system += (weight * transmitted[int(i)]) * terms * terms.transpose();
    right += (weight * transmitted[int(i)] * up[int(i)]) * terms;
    mean += weight * terms;
  }
  const Eigen::Vector3d c = system.fullPivLu().solve(right);
  const double scale = 1 / (2 * eta * eta * mean.dot(c));
  return {c[0] * scale, c[1] * scale, c[2] * scale};
}

float similar_albedo(float albedo, float g) {
  return albedo * (1 - g) / (1 - albedo * g);
}
double unsimilar_albedo(double similar, double g) {
  return similar / (1 - g + similar * g);
}

}  // namespace

HalfSpaceLight half_space_light(double albedo, double eta, double g) {
  const double least = 1e-4;  // below, only the shape matters
  const double a = std::clamp(albedo, least, 1.0);
  const QuadratureRule rule = inside_cosines(eta);
  const int n = int(rule.x.size());
  Eigen::VectorXd transmitted(n), scale(n);
  for (int i = 0; i < n; ++i) {
    transmitted[i] = 1 - fresnel_dielectric(rule.x[size_t(i)], 1 / eta);
    scale[i] = std::sqrt(rule.w[size_t(i)] * rule.x[size_t(i)]);
  }
  // up = K (entered + internal reflectance * up), K the reflection of the medium alone.
  const Eigen::MatrixXd K = reflection(a, g, rule);
  const Eigen::VectorXd entered = scale.cwiseProduct(transmitted), mirrored = Eigen::VectorXd::Ones(n) - transmitted;
  const Eigen::VectorXd up =
      (Eigen::MatrixXd::Identity(n, n) - K * mirrored.asDiagonal()).partialPivLu().solve(K * entered);
  HalfSpaceLight light;
  light.escape = fitted(rule, transmitted, up.cwiseQuotient(scale), eta);
  if (albedo >= least) light.reflectance = albedo >= 1 ? 1 : std::clamp(entered.dot(up) / entered.dot(scale), 0.0, 1.0);
  return light;
}

HalfSpaceTable::HalfSpaceTable(double eta, double g) : g_(float(g)), entries_(table_steps + 1) {
  for (int i = 0; i <= table_steps; ++i) {
    const double x = double(i) / table_steps;
    const HalfSpaceLight light = half_space_light(unsimilar_albedo(1 - x * x, g), eta, g);
    Entry& e = entries_[size_t(i)];
    e.reflectance = float(light.reflectance);
    for (size_t k = 0; k < 3; ++k) e.escape[k] = float(light.escape[k]);
  }
  for (int i = table_steps; i > 0; --i)
    entries_[size_t(i - 1)].reflectance =
        std::max(entries_[size_t(i - 1)].reflectance, entries_[size_t(i)].reflectance);
}

HalfSpaceTable::Entry HalfSpaceTable::at(float albedo) const {
  const float x = std::sqrt(1 - similar_albedo(std::clamp(albedo, 0.0f, 1.0f), g_)) * table_steps;
  const size_t i = std::min(size_t(x), size_t(table_steps - 1));
  const float f = x - float(i);
  const Entry &a = entries_[i], &b = entries_[i + 1];
  Entry e{a.reflectance * (1 - f) + b.reflectance * f, {}};
  for (size_t k = 0; k < 3; ++k) e.escape[k] = a.escape[k] * (1 - f) + b.escape[k] * f;
  return e;
}

float HalfSpaceTable::albedo(float reflectance) const {
  const float r = std::clamp(reflectance, 0.0f, 1.0f);
  const auto after = std::lower_bound(entries_.begin() + 1, entries_.end(), r,
                                      [](const Entry& a, float b) { return a.reflectance > b; });
  if (after == entries_.end()) return 0;
  const size_t i = size_t(after - entries_.begin()) - 1;
  const float step = entries_[i].reflectance - entries_[i + 1].reflectance;
  const float f = step > 0 ? std::clamp((entries_[i].reflectance - r) / step, 0.0f, 1.0f) : 0;
  const float x = (float(i) + f) / table_steps;
  return float(unsimilar_albedo(1 - double(x) * x, g_));
}

}  // namespace numeric
}  // namespace dapple
