// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {

std::string SceneDescription::resolve(const std::string& filename) const {
  if (filename.empty() || filename.front() == '/' || base_directory.empty()) return filename;
  return base_directory.back() == '/' ? base_directory + filename : base_directory + "/" + filename;
}

}  // namespace dapple::scenefile
