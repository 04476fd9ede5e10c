// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/light/shaft_light.h"
#include "dapple/shafts/air_light.h"

namespace dapple::light {

/// The planes to a light without size, or to a point of a disc.
struct ShaftLight::Set {
  std::unique_ptr<shafts::ScanPlanes> planes;
  std::unique_ptr<shafts::AirLight> air;
  RGB strength;  ///< irradiance across the beam, or a lamp's intensity
};

struct ShaftLight::Source {
  uint32_t light;
  V3f to_light;
  float cosine;  ///< of the disc's radius; below -1 for lights without size
  std::vector<Set> sets;
};

}  // namespace dapple::light
