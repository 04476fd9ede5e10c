// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/dapple_program.h"

namespace dapple::test {

inline const std::string cornell = source_path("scenes/cornell-box/cornell.pbrt");

/// `dapple render` of 16 x 16 pixels, one sample each.
inline ProcessResult render_quickly(const std::vector<std::string>& arguments, const std::string& directory = ".") {
  std::vector<std::string> all{"render"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  all.insert(all.end(), {"--resolution", "16x16", "--pixel-samples", "1"});
  return run_dapple(all, 60, directory);
}

}  // namespace dapple::test
