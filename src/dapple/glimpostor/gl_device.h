// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "dapple/impostor/object_baker.h"
#include "dapple/impostor/projection_device.h"

namespace dapple::glimpostor {

/// How graphics hardware draws images.
/// points: each fragment is a parallelogram on its own plane, instanced, as hardware does it today; the same cover as
/// depthimage::SplatTile.
/// slices: as Max, Deussen and Keating (1999) did: textured squares behind each other, parallel to an image, on each of
/// which a test of alpha, where depth is, keeps the texels of one slab.
enum class GlPath { points, slices };
inline constexpr std::string_view gl_path_names[] = {"points", "slices"};

/// What the images of a path have to be: slices need images that each hold all they see.
impostor::BakeSettings bake_settings(GlPath path);

/// Projection by OpenGL 3.3 core without a window. Which fragment wins where two are equally near, and what happens at
/// their borders, is the driver's matter: pictures are not the same bit for bit on all machines.
/// Null, and why, where there is no such device, or where Dapple was built without OpenGL.
std::shared_ptr<impostor::ProjectionDevice> open_device(GlPath path, std::string* renderer, std::string* why);

}  // namespace dapple::glimpostor
