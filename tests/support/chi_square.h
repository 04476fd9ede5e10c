// SPDX-License-Identifier: Apache-2.0
#pragma once

// Statistical tests of samplers and estimators, for the tests of every library.
//
//   const auto result = test::chi_square_sphere([&](KeyedRng& rng) { return sample(rng); }, [&](const V3f& w) { return
//   pdf(w); }); EXPECT_GT(result.p_value, test::sidak(0.01, tests)) << result.message;
//
// Samplers draw their random numbers from the KeyedRng they are handed, so a test gives the same answer every time.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "dapple/base/hash.h"
#include "dapple/base/vec.h"
#include "dapple/numeric/quadrature.h"

namespace dapple::test {

/// Regularised upper incomplete gamma function Q(a, x), a > 0, x >= 0: series below a + 1, continued fraction (Lentz)
/// above.
inline double gamma_q(double a, double x) {
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 100000 && term > sum * 1e-16; ++n) sum += term *= x / (a + n);
    return std::clamp(1 - front * sum, 0.0, 1.0);
  }
  constexpr double tiny = 1e-300;
  double b = x + 1 - a, c = 1 / tiny, d = 1 / b, h = d;
  for (int n = 1; n < 100000; ++n) {
    const double numerator = -n * (n - a);
    b += 2;
    d = numerator * d + b;
    c = b + numerator / c;
    if (std::abs(d) < tiny) d = tiny;
    if (std::abs(c) < tiny) c = tiny;
    d = 1 / d;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-15) break;
  }
  return std::clamp(front * h, 0.0, 1.0);
}

/// Probability that a chi-squared variable of `dof` degrees of freedom exceeds `statistic`.
inline double chi_square_p(double statistic, int dof) {
  return dof > 0 ? gamma_q(dof / 2.0, statistic / 2) : 1;
}

/// Level of each of `tests` independent tests for which all together reject a true hypothesis with probability
/// `family_level`.
inline double sidak(double family_level, int tests) {
  return -std::expm1(std::log1p(-family_level) / tests);
}

struct ChiSquareResult {
  double p_value = 0;  ///< 0 also where the densities contradict the samples outright: see message
  double statistic = 0;
  int dof = 0;
  int pooled = 0;       ///< cells of small expectation counted as one
  double integral = 0;  ///< of the density, where one was integrated
  std::string message;
};

/// Pearson's test of counts against expected counts (of equal sums). Cells that expect fewer than `min_expected` are
/// pooled. Counts where nothing at all is expected are an outright failure beyond `stray` of all counts (round-off at
/// cell edges).
inline ChiSquareResult chi_square_counts(std::span<const double> observed, std::span<const double> expected,
                                         double min_expected = 5, double stray = 1e-5) {
  ChiSquareResult out;
  std::vector<size_t> order(expected.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return expected[a] < expected[b]; });
  const double total = std::accumulate(observed.begin(), observed.end(), 0.0);
  double impossible = 0, pool_o = 0, pool_e = 0;
  int groups = 0;
  for (const size_t i : order) {
    if (expected[i] <= total * 1e-12) impossible += observed[i];
    if (expected[i] < min_expected || (pool_e > 0 && pool_e < min_expected)) {
      pool_o += observed[i];
      pool_e += expected[i];
      ++out.pooled;
      continue;
    }
    const double d = observed[i] - expected[i];
    out.statistic += d * d / expected[i];
    ++groups;
  }
  if (pool_e >= min_expected || (pool_e > 0 && pool_o > min_expected)) {
    out.statistic += (pool_o - pool_e) * (pool_o - pool_e) / pool_e;
    ++groups;
  }
  out.dof = groups - 1;
  std::ostringstream text;
  if (impossible > stray * total) {
    text << impossible << " of " << total << " samples where the density is zero";
  } else {
    out.p_value = chi_square_p(out.statistic, out.dof);
    text << "chi^2 = " << out.statistic << ", " << out.dof << " degrees of freedom, " << out.pooled
         << " cells pooled, p = " << out.p_value;
  }
  out.message = text.str();
  return out;
}

struct ChiSquareOptions {
  int cells_x = 48;  ///< around the sphere, or along x of the square
  int cells_y = 24;  ///< in cos(theta), or along y
  int samples = 400000;
  uint64_t seed = 1;
  double min_expected = 5;
  double mass_tolerance = 1e-3;  ///< of the density's integral against the share of samples that were not refused
};

namespace detail {

struct Point {
  double x, y;
};

/// Adaptive integration of a function over rectangles: tensor Gauss-Legendre, halved along the axis where that changes
/// more, until neither does. Where the given points crowd in a small part of a rectangle there is a peak, and it is
/// halved anyway.
class Cubature {
 public:
  explicit Cubature(std::function<double(double, double)> f) : f_(std::move(f)), rule_(gauss_legendre(5, 0, 1)) {}

  double integrate(double x0, double x1, double y0, double y1, std::span<Point> points) const {
    const Box box{x0, x1, y0, y1};
    return refine(box, panel(box), points, 0, 0);
  }

 private:
  struct Box {
    double x0, x1, y0, y1;
    Box left() const { return {x0, (x0 + x1) / 2, y0, y1}; }
    Box right() const { return {(x0 + x1) / 2, x1, y0, y1}; }
    Box below() const { return {x0, x1, y0, (y0 + y1) / 2}; }
    Box above() const { return {x0, x1, (y0 + y1) / 2, y1}; }
  };
  static constexpr int max_halvings = 22;  // of each axis

  double panel(const Box& b) const {
    double sum = 0;
    for (size_t j = 0; j < rule_.x.size(); ++j)
      for (size_t i = 0; i < rule_.x.size(); ++i)
        sum += rule_.w[i] * rule_.w[j] * f_(b.x0 + (b.x1 - b.x0) * rule_.x[i], b.y0 + (b.y1 - b.y0) * rule_.x[j]);
    return sum * (b.x1 - b.x0) * (b.y1 - b.y0);
  }

  /// Interquartile range of a coordinate; infinite for a handful of points.
  static double spread(std::span<const Point> points, double Point::*coordinate) {
    if (points.size() < 16) return std::numeric_limits<double>::infinity();
    std::vector<double> v;
    for (const Point& p : points) v.push_back(p.*coordinate);
    const auto at = [&](size_t i) {
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(i), v.end());
      return v[i];
    };
    return at(3 * v.size() / 4) - at(v.size() / 4);
  }

  double refine(const Box& b, double whole, std::span<Point> points, int halved_x, int halved_y) const {
    if (!std::isfinite(whole)) return whole;
    const double left = panel(b.left()), right = panel(b.right());
    const double below = panel(b.below()), above = panel(b.above());
    const double change_x = halved_x < max_halvings ? std::abs(left + right - whole) : 0;
    const double change_y = halved_y < max_halvings ? std::abs(below + above - whole) : 0;
    const double tolerance = 1e-7 + 1e-6 * std::abs(whole);
    const bool agree = std::max(change_x, change_y) <= tolerance;
    const double spread_x = halved_x < max_halvings ? spread(points, &Point::x) / (b.x1 - b.x0) : 1;
    const double spread_y = halved_y < max_halvings ? spread(points, &Point::y) / (b.y1 - b.y0) : 1;
    const bool crowded = std::min(spread_x, spread_y) < 0.2;  // even points give 0.5
    const bool first = halved_x == 0 || halved_y == 0;
    if (agree && !crowded && !first) return (left + right + below + above) / 2;
    const bool along_x = !agree ? change_x > change_y : crowded ? spread_x < spread_y : halved_x == 0;
    const auto split = std::partition(points.begin(), points.end(), [&](const Point& p) {
      return along_x ? p.x < b.right().x0 : p.y < b.above().y0;
    });
    const std::span low(points.begin(), split), high(split, points.end());
    if (along_x)
      return refine(b.left(), left, low, halved_x + 1, halved_y) +
             refine(b.right(), right, high, halved_x + 1, halved_y);
    return refine(b.below(), below, low, halved_x, halved_y + 1) +
           refine(b.above(), above, high, halved_x, halved_y + 1);
  }

  std::function<double(double, double)> f_;
  QuadratureRule rule_;
};

struct Domain {
  double x0, x1, y0, y1;
};

inline ChiSquareResult chi_square_cells(const Domain& domain,
                                        const std::function<std::optional<Point>(KeyedRng&)>& sample,
                                        const std::function<double(double, double)>& pdf, const ChiSquareOptions& o) {
  const auto nx = static_cast<size_t>(o.cells_x), ny = static_cast<size_t>(o.cells_y);
  const double dx = (domain.x1 - domain.x0) / o.cells_x, dy = (domain.y1 - domain.y0) / o.cells_y;
  std::vector<std::vector<Point>> cells(nx * ny);
  double kept = 0;
  for (int i = 0; i < o.samples; ++i) {
    KeyedRng rng(hash(o.seed, i));
    const std::optional<Point> p = sample(rng);
    if (!p) continue;
    const double x = std::clamp((p->x - domain.x0) / dx, 0.0, o.cells_x - 1.0);
    const double y = std::clamp((p->y - domain.y0) / dy, 0.0, o.cells_y - 1.0);
    if (!std::isfinite(p->x) || !std::isfinite(p->y)) return {.message = "a sample is not finite"};
    cells[static_cast<size_t>(y) * nx + static_cast<size_t>(x)].push_back(*p);
    ++kept;
  }
  bool valid = true;
  const Cubature cubature([&](double x, double y) {
    const double v = pdf(x, y);
    valid = valid && v >= 0 && std::isfinite(v);
    return v;
  });
  std::vector<double> observed, expected;
  double integral = 0;
  for (size_t j = 0; j < ny; ++j) {
    for (size_t i = 0; i < nx; ++i) {
      auto& points = cells[j * nx + i];
      observed.push_back(static_cast<double>(points.size()));
      const double x = domain.x0 + dx * static_cast<double>(i), y = domain.y0 + dy * static_cast<double>(j);
      expected.push_back(cubature.integrate(x, x + dx, y, y + dy, points));
      integral += expected.back();
    }
  }
  const double share = kept / o.samples;
  ChiSquareResult out;
  std::ostringstream text;
  if (!valid) {
    text << "the density is negative or not finite somewhere";
  } else if (std::abs(integral - share) > o.mass_tolerance + 4 * std::sqrt(share * (1 - share) / o.samples)) {
    text << "the density integrates to " << integral << ", but the share of samples not refused is " << share;
  } else {
    for (double& e : expected) e *= kept / integral;
    out = chi_square_counts(observed, expected, o.min_expected);
    text << out.message << ", integral of the density " << integral;
  }
  out.integral = integral;
  out.message = text.str();
  return out;
}

}  // namespace detail

/// Tests that directions drawn by `sample` have the solid-angle density `pdf`, whose integral is the probability that a
/// sample is not refused (nullopt). Cells are equal in cos(theta) and phi about +z. The density is integrated over each
/// cell adaptively, so peaks are found wherever samples fall; steps are followed until a panel matters less than 1e-7.
inline ChiSquareResult chi_square_sphere(const std::function<std::optional<V3f>(KeyedRng&)>& sample,
                                         const std::function<double(const V3f&)>& pdf,
                                         const ChiSquareOptions& options = {}) {
  const detail::Domain domain{-std::numbers::pi, std::numbers::pi, -1, 1};
  return detail::chi_square_cells(
      domain,
      [&](KeyedRng& rng) -> std::optional<detail::Point> {
        const std::optional<V3f> w = sample(rng);
        if (!w) return std::nullopt;
        return detail::Point{std::atan2(double(w->y), double(w->x)), std::clamp(double(w->z), -1.0, 1.0)};
      },
      [&](double phi, double z) {
        const double r = std::sqrt(std::max(0.0, (1 - z) * (1 + z)));
        return pdf(
            V3f(static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)), static_cast<float>(z)));
      },
      options);
}

/// The same on the unit square, `pdf` with respect to its area.
inline ChiSquareResult chi_square_square(const std::function<std::optional<V2f>(KeyedRng&)>& sample,
                                         const std::function<double(const V2f&)>& pdf,
                                         const ChiSquareOptions& options = {}) {
  return detail::chi_square_cells(
      detail::Domain{0, 1, 0, 1},
      [&](KeyedRng& rng) -> std::optional<detail::Point> {
        const std::optional<V2f> p = sample(rng);
        if (!p) return std::nullopt;
        return detail::Point{p->x, p->y};
      },
      [&](double x, double y) { return pdf(V2f(static_cast<float>(x), static_cast<float>(y))); }, options);
}

/// Running mean and variance (Welford 1962).
class Moments {
 public:
  void add(double x) {
    ++n_;
    const double d = x - mean_;
    mean_ += d / static_cast<double>(n_);
    m2_ += d * (x - mean_);
  }
  int64_t count() const { return n_; }
  double mean() const { return mean_; }
  double variance() const { return n_ > 1 ? m2_ / static_cast<double>(n_ - 1) : 0; }  ///< of one value, unbiased
  double variance_of_mean() const { return n_ > 0 ? variance() / static_cast<double>(n_) : 0; }

 private:
  int64_t n_ = 0;
  double mean_ = 0, m2_ = 0;
};

/// Two-sided p-value that `a` estimates `truth`; `truth_error` is what truth itself may be off by (quadrature), not
/// penalised. Needs enough values for their mean to be normal.
inline double z_test(const Moments& a, double truth, double truth_error = 0) {
  const double off = std::max(0.0, std::abs(a.mean() - truth) - truth_error), sigma = std::sqrt(a.variance_of_mean());
  if (off == 0) return 1;
  return sigma > 0 ? std::erfc(off / sigma / std::numbers::sqrt2) : 0;
}

/// Two-sided p-value that two independent estimators have the same mean.
inline double z_test(const Moments& a, const Moments& b) {
  const double off = std::abs(a.mean() - b.mean()), sigma = std::sqrt(a.variance_of_mean() + b.variance_of_mean());
  if (off == 0) return 1;
  return sigma > 0 ? std::erfc(off / sigma / std::numbers::sqrt2) : 0;
}

}  // namespace dapple::test
