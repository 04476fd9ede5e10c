// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/scattering/lobes.h"

namespace dapple::scattering {

enum class BsdfKind : uint8_t {
  // Those that scatter the same to all directions of a side come first.
  black,                 ///< absorbs everything
  diffuse,               ///< Lambertian reflection
  diffuse_transmission,  ///< Lambertian reflection and transmission (leaves)
  conductor,             ///< GGX, or a mirror below the smoothness threshold
  dielectric,            ///< GGX reflection and refraction, or smooth
  thin_dielectric,       ///< a thin sheet, straight through
  coated,                ///< a dielectric coat over a diffuse or conducting base, stochastic (Guo et al. 2018)
  subsurface,            ///< the boundary of a body that scatters inside: as dielectric, and samples of it lose nothing
  passthrough,           ///< the surface is not there (interface, alpha)
  // Kinds with a file of their own.
  principled,  ///< layers of OpenPBR (principled.h)
  hair,        ///< a fibre (hair.h)
  measured     ///< a table (measured_table.h)
};

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

/// What lies between a coat and its base, and how the walk through it is limited (pbrt-v4's parameters).
struct CoatLayer {
  float thickness = 0.01f;  ///< in mean free paths: the layer attenuates by exp(-thickness / |cos|) a crossing
  float g = 0;              ///< Henyey-Greenstein asymmetry
  RGB medium_albedo;        ///< single-scattering albedo; black: the layer only absorbs
  int max_depth = 10;       ///< events inside the layer; at most 65535
  int sample_count = 1;     ///< walks averaged by one evaluation
};

}  // namespace dapple::scattering
