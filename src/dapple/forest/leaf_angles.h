// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "dapple/numeric/quadrature.h"

namespace dapple::forest {

/// How leaf normals are inclined: the density g(theta) of the angle between normal and zenith, theta in [0, pi/2],
/// uniform in azimuth, with integral one (the sine of the solid angle is part of g: spherical leaves have g = sin
/// theta). Leaves are two-sided; every constructor throws std::invalid_argument for parameters out of range.
class LeafAngles {
 public:
  static LeafAngles spherical();     ///< sin theta; also called uniform normals
  static LeafAngles planophile();    ///< (2/pi)(1 + cos 2 theta), mostly horizontal
  static LeafAngles erectophile();   ///< (2/pi)(1 - cos 2 theta), mostly vertical
  static LeafAngles plagiophile();   ///< (2/pi)(1 - cos 4 theta), mostly at 45 degrees
  static LeafAngles extremophile();  ///< (2/pi)(1 + cos 4 theta)
  static LeafAngles uniform();       ///< 2/pi, uniform in inclination
  static LeafAngles horizontal();
  static LeafAngles vertical();
  /// One inclination in [0, pi/2], radians.
  static LeafAngles fixed(double inclination);
  /// Goel and Strebel 1984: theta = (pi/2) x where x has a beta distribution of this mean inclination (radians, in
  /// (0, pi/2)) and standard deviation (radians, in (0, sqrt(mean (pi/2 - mean)))).
  static LeafAngles beta(double mean, double standard_deviation);
  /// Campbell 1986, 1990: normals distributed as on an ellipsoid of axis ratio chi = horizontal over vertical, in
  /// [0.001, 1000]; 1 is spherical, large is horizontal.
  static LeafAngles ellipsoidal(double chi);
  /// Histogram: fractions[i] of the leaf area has inclinations in [edges[i], edges[i + 1]], evenly. Edges ascend within
  /// [0, pi/2], radians; fractions are not negative and are normalised.
  static LeafAngles table(std::vector<double> edges, std::vector<double> fractions);
  /// By name: spherical, planophile, erectophile, plagiophile, extremophile, uniform, horizontal, vertical.
  static LeafAngles by_name(std::string_view name);
  static const std::vector<std::string_view>& names();

  /// g(theta) in 1/rad; zero for distributions of discrete inclinations.
  double density(double theta) const;
  /// The discrete inclination, or a negative number where there is a density.
  double discrete() const { return discrete_; }
  /// Angles between which g is smooth, from 0 to pi/2.
  const std::vector<double>& breaks() const { return breaks_; }
  /// Sum of w f(x) is the integral of f g over theta. `kinks` are the angles (any order, any range) where f or a
  /// derivative of it jumps; powers of half-integer order there are integrated to full order.
  QuadratureRule quadrature(const std::vector<double>& kinks) const;
  /// Ross's projection G: mean of |n . omega|, for cos theta of the direction. Half for spherical leaves.
  double projection(double mu) const;
  double mean_inclination() const;  ///< radians

 private:
  enum class Kind { sine, cosine_series, beta, ellipsoidal, table, discrete };
  LeafAngles(Kind kind, double p = 0, double q = 0);
  double raw_density(double theta) const;

  Kind kind_;
  double p_, q_;
  double scale_ = 1, discrete_ = -1, log_norm_ = 0;
  std::vector<double> breaks_, values_;
};

/// Composite Gauss rule on panels between `breaks` (sorted here), graded towards their ends so that x^(3/2) there costs
/// no order.
QuadratureRule graded_rule(std::vector<double> breaks, int points_per_panel = 10);

}  // namespace dapple::forest
