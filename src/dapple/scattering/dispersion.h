// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::scattering {

/// Indices that differ by wavelength, for light of three channels: a path that meets such a body goes on with one
/// channel, at a wavelength that the channel sees, drawn in proportion to its sensitivity under D65 (where that is
/// above zero). What is white stays white in the mean.

/// Cauchy's coefficient B, um^2, of n(l) = A + B / l^2: a body of index `ior` at 587.6 nm, and of an Abbe number
/// (n_d - 1) / (n_F - n_C), above 0.
float cauchy_coefficient(float ior, float abbe);

/// That body's index at a wavelength (nm); at least 1 where it is so at 587.6 nm.
float ior_at(float ior, float cauchy, float wavelength);

/// Wavelength (nm) at which a channel is looked at; u uniform in [0, 1).
float wavelength_of(int channel, float u);

}  // namespace dapple::scattering
