// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "dapple/forest/directions.h"

namespace dapple::forest {

enum class Method {
  adding_doubling,  ///< slabs by Pade form and doubling, stacked from the ground up (5.6)
  riccati           ///< F(z) and E(z) integrated upwards, radiance downwards, by fourth-order Runge-Kutta (5.5)
};

struct SolverOptions {
  PolarNodes nodes = PolarNodes::gauss(8);
  int modes = 4;  ///< azimuthal cosine modes, m = 0 .. modes - 1; fluxes need only one
  Method method = Method::adding_doubling;
  double riccati_step =
      0.03;  ///< largest kappa dz / mu of a step: unstable above 1.3, error below 1e-9 at .03, as its fourth power
  size_t max_bytes = size_t{1} << 30;  ///< of kept operators; MemoryError above
};

}  // namespace dapple::forest
