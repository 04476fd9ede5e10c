// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "dapple/base/rgb.h"

namespace dapple::media {

/// Measured scattering of a substance, as published, in 1/mm: reduced scattering sigma_s (1 - g) and absorption, under
/// the names pbrt-v4 gives them.
struct MeasuredMedium {
  std::string_view name;
  RGB reduced_scattering;
  RGB absorption;
};

/// Twelve of Jensen et al. 2001 ("A practical model for subsurface light transport") and the liquids and powders of
/// Narasimhan et al. 2006
/// ("Acquiring scattering properties of participating media by dilution").
std::span<const MeasuredMedium> measured_media();
const MeasuredMedium* find_measured_medium(std::string_view name);  ///< nullptr for unknown names

}  // namespace dapple::media
