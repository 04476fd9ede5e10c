// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/emitters/light.h"

namespace dapple::integrate {

/// What a light at infinity puts on a level plane under nothing, W m^-2 by channel.
std::array<double, 3> irradiance_above(const emitters::Light& light);

}  // namespace dapple::integrate
