// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "dapple/numeric/spectrum.h"

namespace dapple {
inline namespace numeric {

/// The spectra pbrt-v4 knows by name, from published data (the tables' sources stand in spectrum_data_*.cpp):
///   stdillum-A, -D50, -D65, -F1 ... -F12, illum-acesD60       CIE standard illuminants, relative
///   glass-BK7, -BAF10, -FK51A, -LASF9, -F5, -F10, -F11        index; pbrt's F5, F10, F11 are Schott's SF5, SF10, SF11,
///   also known as such metal-Ag, -Al, -Au, -Cu, -CuZn, -MgO, -TiO2, each -eta and -k
/// Differences to pbrt-v4's tables: Ag, Au, Cu and Al are other measurements than its; D50 is CIE's (its table
/// departs from that). pbrt's sensor responses (canon_eos_..., ...) are not known here. nullopt for other names.
std::optional<SampledSpectrum> find_named_spectrum(std::string_view name);

/// All names, in the order above.
std::vector<std::string_view> spectrum_names();

}  // namespace numeric
}  // namespace dapple
