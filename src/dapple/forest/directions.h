// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dapple/forest/leaf_angles.h"

namespace dapple::forest {

/// Polar directions of one hemisphere: node i stands for w[i] of the cosines in (0, 1); the weights sum to one. The
/// other hemisphere is its mirror image.
struct PolarNodes {
  std::vector<double> mu, w;
  /// What a node's kernels are averages over; empty: the node itself.
  std::vector<QuadratureRule> bins;

  int size() const { return static_cast<int>(mu.size()); }
  /// n Gauss-Legendre nodes, 1 <= n <= 64: fluxes to about 1e-6 with 8 (illumination under trees, 5.4 B).
  static PolarNodes gauss(int n);
  /// The ten bands of Mobley's radiative transfer, edges at 0, 5, 15, ..., 85, 90 degrees, kernels averaged over each
  /// band (5.4 A). Errors of fluxes are some .5 %.
  static PolarNodes mobley();
};

/// Half-range modes c+-^m (5.3) of all nodes, and of one further direction if there is one, at all normals of a rule.
struct FlakeTable {
  std::vector<double> theta;        ///< normals
  std::vector<double> plus, minus;  ///< [m][normal][direction]
};

/// The directions for which kernels are wanted: nodes, and possibly one direction of weight zero (sun or view).
class Directions {
 public:
  Directions(const PolarNodes& nodes, int modes, std::optional<double> extra_mu = std::nullopt);

  const PolarNodes& nodes() const { return nodes_; }
  int modes() const { return modes_; }
  int size() const { return nodes_.size() + (extra_ ? 1 : 0); }
  std::optional<double> extra() const { return extra_; }
  /// Where kernels bend: inclinations of the normals orthogonal to a direction.
  const std::vector<double>& kinks() const { return kinks_; }
  /// Made once for all leaf angle distributions that are smooth between the same angles. Not thread-safe.
  const FlakeTable& flakes(const LeafAngles& leaves, const QuadratureRule& normals);

 private:
  PolarNodes nodes_;
  int modes_;
  std::optional<double> extra_;
  std::vector<double> kinks_;
  std::map<std::vector<double>, FlakeTable> tables_;
};

}  // namespace dapple::forest
