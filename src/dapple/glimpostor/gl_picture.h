// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/depthimage/object_picture.h"
#include "dapple/glimpostor/gl_device.h"

namespace dapple::glimpostor {

struct GlPictureSettings {
  GlPath path = GlPath::points;
  /// Unit, object space: what is shown is reflectance and transmittance times max(0, n . l). Without: as they are.
  std::optional<V3f> to_light;
  /// Of slices: two passes, unshaded and shaded through a colour matrix, multiplied where they meet. Else what
  /// sub-samples show is shaded after that.
  bool two_passes = true;
};

/// depthimage::project() by graphics hardware: an object in a camera, by one level. Slices need images that are limited
/// to layers (bake_settings()). Null, and why, without a device.
std::optional<depthimage::ObjectPicture> gl_picture(const depthimage::SplatObject& object, int level,
                                                    const depthimage::ScreenMap& camera, const V2i& resolution,
                                                    const GlPictureSettings& settings, std::string* why);

}  // namespace dapple::glimpostor
