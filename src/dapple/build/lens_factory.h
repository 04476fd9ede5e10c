// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/build/build_context.h"
#include "dapple/scene/camera.h"
#include "dapple/scene/lens_system.h"

namespace dapple::build {

/// The lens of camera "realistic": "lensfile" (a line a surface, from the scene to the film: radius of curvature,
/// thickness to the next, index behind, diameter; millimetres, `#` begins a comment; radius 0 is the stop),
/// "aperturediameter" (mm), "aperture" (a shape's name or a picture), "focusdistance" (m from the film), and "diagonal"
/// of the film (mm). Throws InputError.
std::shared_ptr<const scene::LensSystem> make_lens_system(const BuildContext& context);

/// Degrees across the shorter side of the picture, of a pinhole in the place of its lens.
float lens_fov(const scene::Camera::Settings& settings);

}  // namespace dapple::build
