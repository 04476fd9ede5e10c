// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

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

}  // namespace dapple::scattering
