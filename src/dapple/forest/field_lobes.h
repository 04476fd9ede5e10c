// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/canopy_field.h"

namespace dapple::forest {

/// Which light counts: all, or that which travels downwards or upwards.
enum class From { everywhere, above, below };

/// E(z, n) of 5.8: diffuse irradiance on the side facing a normal of signed cosine mu_n and azimuth phi (as the
/// field's), [level][wavelength].
std::vector<double> irradiance_on(const CanopyOperators& canopy, const Field& field, double mu_n, double phi,
                                  From from);
/// S(z, r) of 5.8: integral of the diffuse radiance times (s + 1) / (2 pi) max(w . r, 0)^s over propagation
/// directions w, [level][wavelength]; a lobe must be wider than the nodes' spacing.
std::vector<double> light_in_lobe(const CanopyOperators& canopy, const Field& field, double mu_r, double phi,
                                  double exponent);

}  // namespace dapple::forest
