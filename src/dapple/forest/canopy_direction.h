// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/forest/canopy_operators.h"

namespace dapple::forest {

/// What one further direction, of the sun or a view, needs of a canopy: everything that does not depend on the light.
struct CanopyDirection {
  double mu = 1;
  std::vector<double> path;              ///< by slab type: kappa / mu for the whole slab
  std::vector<Pack> same, opposite;      ///< [pack][type][node]: sigma^m sqrt(w / mu) for the whole slab
  std::vector<DirectionSolver> solvers;  ///< [pack][type]
  std::vector<Pack> ground;              ///< [pack][node]: f^m sqrt(w mu) between this direction and the nodes
};

/// mu in (0, 1], else std::invalid_argument.
std::shared_ptr<const CanopyDirection> make_direction(const CanopyOperators& canopy, double mu);

}  // namespace dapple::forest
