// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/build/scene_origin.h"
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
  Origins origins{};
};

/// Throws InputError: the directive's type is none of `legal`.
[[noreturn]] inline void unknown_type(const scenefile::Entity& e, const char* what,
                                      const std::vector<std::string_view>& legal) {
  throw InputError(e.loc, std::string(what) + " \"" + e.type + "\" is unknown; " + one_of(legal));
}

}  // namespace dapple::build
