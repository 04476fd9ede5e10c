// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/forest/canopy_field.h"

namespace dapple::forest {

/// Radiance of light travelling along a direction of signed cosine (positive upwards; its magnitude is view's), at
/// all levels: [azimuth][level][wavelength]. Azimuths of propagation against the beam's, radians. By integration of
/// the source function along the way, exact for the discretised field; single scattering of the beam by the full
/// phase function instead of its modes. The unscattered beam is not part of it; skylight is.
std::vector<double> radiance_along(const CanopyOperators& canopy, const Field& field, const CanopyDirection& view,
                                   bool upward, std::span<const double> azimuths);

/// Hot spot: what single scattering of a beam towards an upward view at the top gains because leaves of this
/// characteristic size (m) are seen through the gaps the sun came by (Kuusk 1985): joint gap probabilities with
/// correlation exp(-D dz / size), D the horizontal separation of the two paths per height. To be added to
/// radiance_along() at the top, unit beam: [wavelength]. The multiply scattered light is not diminished by it, so that
/// energy is not conserved. azimuth as in radiance_along().
std::vector<double> hot_spot_gain(const CanopyOperators& canopy, const CanopyDirection& sun,
                                  const CanopyDirection& view, double azimuth, double leaf_size_m);

}  // namespace dapple::forest
