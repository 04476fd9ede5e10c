// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/solver.h"

namespace dapple::forest {

/// Slabs of equal content share their operators.
struct CanopySolver::Type {
  std::vector<double> amount;
  double depth = 0;  ///< largest kappa / mu of a node
};

/// Of the four systems of a pack, [..][n][n] each.
struct CanopySolver::Operators {
  std::vector<Pack> m1, m2, r, t;  ///< by slab type
  std::vector<Pack> f;             ///< by level: what is below it reflects f
  std::vector<Pack> lu;            ///< by slab: factors of 1 - r f
};

/// The second method: one pack of a field by Runge-Kutta.
class Riccati {
 public:
  /// Fills up and down ([level][node]) of a pack, whose down at the top level is given; rates as in the field, or null.
  static void sweep(const CanopySolver& solver, size_t pack, const CanopySolver::Direction* sun, const double* beam,
                    const Pack* rates, const Pack* ground_source, Pack* up, Pack* down, Scratch& scratch);
};

}  // namespace dapple::forest
