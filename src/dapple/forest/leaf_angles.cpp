// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/leaf_angles.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "dapple/base/error.h"
#include "dapple/forest/half_range.h"

namespace dapple::forest {

namespace {
constexpr double half_pi = std::numbers::pi / 2;
}

QuadratureRule graded_rule(std::vector<double> breaks, int points_per_panel) {
  std::sort(breaks.begin(), breaks.end());
  const QuadratureRule unit = gauss_legendre(points_per_panel, 0, 1);
  QuadratureRule rule;
  for (size_t p = 0; p + 1 < breaks.size(); ++p) {
    const double a = breaks[p], length = breaks[p + 1] - a;
    if (length < 1e-13) continue;
    for (int i = 0; i < points_per_panel; ++i) {
      const double s = unit.x[i];
      rule.x.push_back(a + length * s * s * (3 - 2 * s));
      rule.w.push_back(unit.w[i] * length * 6 * s * (1 - s));
    }
  }
  return rule;
}

LeafAngles::LeafAngles(Kind kind, double p, double q) : kind_(kind), p_(p), q_(q), breaks_{0, half_pi} {
  if (kind == Kind::beta || kind == Kind::ellipsoidal) {
    // Bisecting towards both ends resolves what is narrow or singular there.
    const int depth = kind == Kind::ellipsoidal ? 2 + static_cast<int>(std::abs(std::log2(p)))
                      : std::min(p, q) >= 2     ? 2
                                                : 14;
    double step = half_pi / 2;
    breaks_.push_back(step);
    log_norm_ = kind == Kind::beta ? std::lgamma(p_) + std::lgamma(q_) - std::lgamma(p_ + q_) : 0;
    for (int i = 0; i < depth; ++i, step /= 2) breaks_.insert(breaks_.end(), {step / 2, half_pi - step / 2});
    std::sort(breaks_.begin(), breaks_.end());
    scale_ = 1 / graded_rule(breaks_).integrate([this](double t) { return raw_density(t); });
  }
}

LeafAngles LeafAngles::spherical() {
  return LeafAngles(Kind::sine);
}
LeafAngles LeafAngles::planophile() {
  return LeafAngles(Kind::cosine_series, 1, 2);
}
LeafAngles LeafAngles::erectophile() {
  return LeafAngles(Kind::cosine_series, -1, 2);
}
LeafAngles LeafAngles::plagiophile() {
  return LeafAngles(Kind::cosine_series, -1, 4);
}
LeafAngles LeafAngles::extremophile() {
  return LeafAngles(Kind::cosine_series, 1, 4);
}
LeafAngles LeafAngles::uniform() {
  return LeafAngles(Kind::cosine_series, 0, 2);
}
LeafAngles LeafAngles::horizontal() {
  return fixed(0);
}
LeafAngles LeafAngles::vertical() {
  return fixed(half_pi);
}

LeafAngles LeafAngles::fixed(double inclination) {
  if (!(inclination >= 0 && inclination <= half_pi))
    throw std::invalid_argument("inclination must be from 0 to 90 degrees");
  LeafAngles l(Kind::discrete);
  l.discrete_ = inclination;
  return l;
}

LeafAngles LeafAngles::beta(double mean, double standard_deviation) {
  if (!(mean > 0 && mean < half_pi)) throw std::invalid_argument("mean inclination must be between 0 and 90 degrees");
  const double x = mean / half_pi, variance = std::pow(standard_deviation / half_pi, 2);
  if (!(variance > 1e-6 && variance < x * (1 - x)))
    throw std::invalid_argument(
        "standard deviation of inclination must be above 0.09 degrees and below sqrt(mean (90 - mean))");
  const double total = x * (1 - x) / variance - 1;
  return LeafAngles(Kind::beta, x * total, (1 - x) * total);
}

LeafAngles LeafAngles::ellipsoidal(double chi) {
  if (!(chi >= 1e-3 && chi <= 1e3)) throw std::invalid_argument("chi must be from 0.001 to 1000");
  return LeafAngles(Kind::ellipsoidal, chi);
}

LeafAngles LeafAngles::table(std::vector<double> edges, std::vector<double> fractions) {
  if (fractions.empty() || edges.size() != fractions.size() + 1)
    throw std::invalid_argument("a table needs one edge more than fractions");
  double sum = 0;
  for (size_t i = 0; i < fractions.size(); ++i) {
    if (!(edges[i] >= 0 && edges[i + 1] <= half_pi * (1 + 1e-12) && edges[i] < edges[i + 1]))
      throw std::invalid_argument("edges must ascend from 0 to 90 degrees");
    if (!(fractions[i] >= 0 && fractions[i] < 1e300)) throw std::invalid_argument("fractions must not be negative");
    sum += fractions[i];
  }
  if (!(sum > 0 && sum < 1e300)) throw std::invalid_argument("fractions must not all be zero");
  LeafAngles l(Kind::table);
  for (size_t i = 0; i < fractions.size(); ++i) fractions[i] /= sum * (edges[i + 1] - edges[i]);
  l.values_ = std::move(fractions);
  l.breaks_ = std::move(edges);
  return l;
}

const std::vector<std::string_view>& LeafAngles::names() {
  static const std::vector<std::string_view> all{"spherical",    "planophile", "erectophile", "plagiophile",
                                                 "extremophile", "uniform",    "horizontal",  "vertical"};
  return all;
}

LeafAngles LeafAngles::by_name(std::string_view name) {
  static constexpr LeafAngles (*make[])() = {spherical,    planophile, erectophile, plagiophile,
                                             extremophile, uniform,    horizontal,  vertical};
  for (size_t i = 0; i < names().size(); ++i)
    if (names()[i] == name) return make[i]();
  throw std::invalid_argument("unknown leaf angle distribution \"" + std::string(name) + "\", " + one_of(names()));
}

double LeafAngles::raw_density(double theta) const {
  switch (kind_) {
    case Kind::sine:
      return std::sin(theta);
    case Kind::cosine_series:
      return (1 + p_ * std::cos(q_ * theta)) / half_pi;
    case Kind::beta: {
      const double x = std::clamp(theta / half_pi, 1e-300, 1 - 1e-16);
      return std::exp((p_ - 1) * std::log(x) + (q_ - 1) * std::log1p(-x) - log_norm_) / half_pi;
    }
    case Kind::ellipsoidal: {
      const double c = std::cos(theta), s = std::sin(theta), d = c * c + p_ * p_ * s * s;
      return p_ * p_ * p_ * s / (d * d);
    }
    case Kind::table: {
      const auto above = std::upper_bound(breaks_.begin(), breaks_.end(), theta);
      if (above == breaks_.begin() || above == breaks_.end()) return 0;
      return values_[above - breaks_.begin() - 1];
    }
    case Kind::discrete:
      break;
  }
  return 0;
}

double LeafAngles::density(double theta) const {
  return theta < 0 || theta > half_pi ? 0 : scale_ * raw_density(theta);
}

QuadratureRule LeafAngles::quadrature(const std::vector<double>& kinks) const {
  if (discrete_ >= 0) return {{discrete_}, {1.0}};
  std::vector<double> breaks = breaks_;
  for (double k : kinks)
    if (k > breaks_.front() && k < breaks_.back()) breaks.push_back(k);
  // Panels narrow enough for the trigonometric functions in g.
  std::sort(breaks.begin(), breaks.end());
  for (size_t i = 0, count = breaks.size(); i + 1 < count; ++i) {
    const double length = breaks[i + 1] - breaks[i];
    const int parts = static_cast<int>(std::ceil(length / 0.4));
    for (int part = 1; part < parts; ++part) breaks.push_back(breaks[i] + length * part / parts);
  }
  QuadratureRule rule = graded_rule(std::move(breaks));
  double sum = 0;
  for (size_t i = 0; i < rule.x.size(); ++i) sum += rule.w[i] *= density(rule.x[i]);
  for (double& w : rule.w) w /= sum;
  return rule;
}

double LeafAngles::projection(double mu) const {
  if (kind_ == Kind::sine) return 0.5;
  return quadrature({half_pi - std::acos(std::clamp(std::abs(mu), 0.0, 1.0))}).integrate([mu](double theta) {
    double plus, minus;
    half_range_modes(mu, std::cos(theta), 1, &plus, &minus, 1);
    return plus + minus;
  });
}

double LeafAngles::mean_inclination() const {
  return quadrature({}).integrate([](double theta) { return theta; });
}

}  // namespace dapple::forest
