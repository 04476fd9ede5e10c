// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace dapple::scattering {

/// Kinds of scattering. The one table of which lobes count as diffuse, shared by all integrators:
///
/// | lobe | examples | counts as |
/// |---|---|---|
/// | diffuse | diffuse, diffusetransmission, the base under a coat | diffuse bounce (`--bounces`) |
/// | glossy  | rough conductor, rough dielectric, rough coat | specular bounce (`--specular-depth`) |
/// | delta   | smooth conductor, smooth dielectric and coat, thin dielectric | specular bounce |
/// | scattering in a medium | fog | specular bounce |
/// | passthrough | interface, alpha | no bounce |
///
/// pbrt's `maxdepth` d caps the whole path at d - 1 scatterings of any kind and sets --bounces to d - 1. Given on the
/// command line,
/// --bounces and --specular-depth replace that cap.
enum class Lobe : uint8_t { none = 0, diffuse = 1, glossy = 2, delta = 4, passthrough = 8 };

}  // namespace dapple::scattering
