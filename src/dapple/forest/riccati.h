// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/canopy_direction.h"
#include "dapple/forest/canopy_operators.h"

namespace dapple::forest {

/// Method::riccati: one pack of a field by Runge-Kutta. Fills up and down ([level][node]), whose down at the top level
/// is given; beam by level and rates as in the field; without sun these are null.
void sweep_riccati(const CanopyOperators& canopy, size_t pack, const CanopyDirection* sun, const double* beam,
                   const Pack* rates, const Pack* ground_source, Pack* up, Pack* down);

}  // namespace dapple::forest
