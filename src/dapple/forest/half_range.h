// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace dapple::forest {

/// Azimuthal modes of the projected flake: plus[m * stride] = c+^m = (1 / 2 pi) integral of max(n . omega, 0) cos m
/// phi, minus likewise of max(-n . omega, 0), for a direction of cosine mu and a normal of cosine mu_n against the
/// zenith, in closed form (illumination under trees, 5.3). modes >= 1.
void half_range_modes(double mu, double mu_n, int modes, double* plus, double* minus, size_t stride);

}  // namespace dapple::forest
