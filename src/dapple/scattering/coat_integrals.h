// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::scattering {

/// Share of a diffuse base's light that a smooth coat reflects back onto the base:
/// 2 int_0^1 F(mu) exp(-2 thickness / mu) mu dmu, F seen from inside the coat. Accurate to about 1e-5.
float coat_return(float ior, float thickness);

/// Share of a uniform hemisphere of light that a smooth coat reflects, and share it lets down to the base.
struct CoatAlbedo {
  float reflected, entered;
};
CoatAlbedo coat_albedo(float ior, float thickness);

}  // namespace dapple::scattering
