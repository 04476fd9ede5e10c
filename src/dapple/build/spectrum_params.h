// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/base/rgb.h"
#include "dapple/build/build_context.h"
#include "dapple/numeric/conductor_rgb.h"
#include "dapple/numeric/spectrum.h"

namespace dapple::build {

// From a parameter of type rgb, spectrum or blackbody to linear Rec.709 RGB; numeric/spectrum.h says how spectra become
// colours. Values of type rgb are converted from the colour space in force where they stand (the ColorSpace directive).
// A spectrum is a list of wavelength (nm), value pairs, a name (numeric/named_spectra.h), or a text file of pairs. A
// type that is not legal, a wrong number of values, wavelengths that do not increase, negative or non-finite values,
// and unknown names are InputErrors at the parameter's place.

/// Of a light (L, I, illuminant, scale of radiance): rgb as it is; blackbody and spectrum at luminance 1. Legal: rgb,
/// blackbody, spectrum.
RGB illuminant_rgb(const scenefile::Param& param, const BuildContext& context);

/// Of a surface (reflectance, transmittance, single-scattering albedo), in [0, 1]: values beyond are clamped with a
/// warning that names the place. Legal: rgb, spectrum.
RGB reflectance_rgb(const scenefile::Param& param, const BuildContext& context);

/// Of an index or absorption (eta, k, sigma_a, sigma_s), from 0 upwards. Legal: rgb, spectrum, and float for all
/// channels alike.
RGB unbounded_rgb(const scenefile::Param& param, const BuildContext& context);

/// The spectrum itself, for those who integrate before they go to RGB; nullopt for an rgb parameter. A float is a
/// constant spectrum. Legal: rgb, float, spectrum.
std::optional<SampledSpectrum> spectrum_of(const scenefile::Param& param, const BuildContext& context);

/// A conductor by pbrt-v4's parameters <prefix>eta and <prefix>k, or <prefix>reflectance; copper if none is there (as
/// in pbrt-v4). Spectra are fitted by conductor_to_rgb(); rgb values of eta and k are indices by channel. `outer_index`
/// is that of the medium around. Textured parameters are the caller's: here they are InputErrors.
ConductorRgb conductor_of(const scenefile::ParamSet& params, const std::string& prefix, const BuildContext& context,
                          float outer_index = 1);

}  // namespace dapple::build
