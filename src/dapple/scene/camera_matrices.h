// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/scene/camera.h"

namespace dapple::scene {

/// A camera at a time, as OpenEXR's standard attributes tell it: row vectors, p * M, divided by w.
struct CameraMatrices {
  M44f world_to_camera;  ///< +x right, +y up, +z ahead
  /// To the display window: x from 0 on its left to 1 on its right, y from 0 on its top to 1 on its bottom; z from 0 to
  /// 1 for depths from .01 to 1000 (perspective), or 0 to 1 (orthographic). Spherical cameras have none.
  std::optional<M44f> world_to_ndc;
};

CameraMatrices camera_matrices(const Camera& camera);           ///< when its shutter opens
CameraMatrices camera_matrices_at_close(const Camera& camera);  ///< when it closes

}  // namespace dapple::scene
