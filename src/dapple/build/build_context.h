// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/error.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::image {
class TextureSystem;
}

namespace dapple::build {

/// What every factory of this library needs. Lives as long as the build; nothing built keeps a reference to it.
struct BuildContext {
  const scenefile::SceneDescription& description;
  Diagnostics& diagnostics;
  image::TextureSystem& texture_system;
  /// Missing or broken images and meshes become visible stand-ins and a warning instead of an error.
  bool keep_going = false;
};

}  // namespace dapple::build
