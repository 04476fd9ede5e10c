// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/support/image_compare.h"
#include "tests/support/process.h"

namespace dapple::test {

/// Path of a file of the repository, or of the shared scenes and references beside it.
std::string source_path(const std::string& relative);
std::string shared_path(const std::string& relative);

/// True where the tests are built with a sanitizer, which costs time and memory that bounds do not allow for.
bool sanitized();

/// Runs the program with these arguments in `directory`.
ProcessResult run_dapple(const std::vector<std::string>& arguments, double timeout, const std::string& directory = ".");

/// Renders a scene and returns the picture, as it is rendered unless --denoise is among the options. Any exit code but
/// 0 throws std::runtime_error with what the program said.
Picture render(const std::string& scene, const std::vector<std::string>& options, double timeout = 600);

}  // namespace dapple::test
