// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/scene.h"

namespace dapple::scene {

/// Leaves a scene one light only, parallel, towards `to_sun` (unit); irradiance on a plane normal to it, W m^-2.
/// Surfaces no longer shine.
void light_by_sun_only(Scene* scene, const V3f& to_sun, RGB irradiance);

}  // namespace dapple::scene
