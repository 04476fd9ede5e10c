// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "dapple/numeric/spectrum.h"

namespace dapple {
inline namespace numeric {

/// The spectra pbrt-v4 knows by name, from published data (the tables' sources stand in spectrum_data_*.cpp):
///
/// | names | what |
/// |---|---|
/// | stdillum-A, -D50, -D65, -F1 ... -F12; illum-acesD60 | CIE illuminants, relative |
/// | glass-BK7, -BAF10, -FK51A, -LASF9, -F5, -F10, -F11 | index of refraction |
/// | metal-Ag, -Al, -Au, -Cu, -CuZn, -MgO, -TiO2 | with -eta or -k: complex index |
///
/// pbrt's glass-F5, -F10 and -F11 are Schott's SF5, SF10 and SF11, and have these names too.
///
/// Where they differ from pbrt-v4's tables: Ag, Al, Au and Cu are other measurements; D50 is CIE's, which pbrt's
/// departs from. pbrt's sensor responses (canon_eos_..., ...) are not known here. nullopt for other names.
std::optional<SampledSpectrum> find_named_spectrum(std::string_view name);

/// All names, in the order above.
std::vector<std::string_view> spectrum_names();

}  // namespace numeric
}  // namespace dapple
