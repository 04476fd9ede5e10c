// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/scattering/lobes.h"

namespace dapple::scattering {

/// A draw from Bsdf::sample. `weight` is f |cos theta| / pdf.
struct BsdfSample {
  V3f wi{0, 0, 1};
  RGB weight;
  /// Of all lobes together, solid angle; 0 for delta and passthrough lobes, and for what light does that a rough
  /// subsurface boundary scatters more than once: MIS leaves those out.
  float pdf = 0;
  Lobe lobe = Lobe::none;
  bool transmitted = false;
  float eta = 1;  ///< eta transmitted / eta incident of a refraction; for Russian roulette only
};

}  // namespace dapple::scattering
