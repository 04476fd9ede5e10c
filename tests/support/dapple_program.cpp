// SPDX-License-Identifier: Apache-2.0
#include "tests/support/dapple_program.h"

#include <algorithm>
#include <stdexcept>

namespace dapple::test {

std::string source_path(const std::string& relative) {
  return DAPPLE_SOURCE_DIR "/" + relative;
}
std::string shared_path(const std::string& relative) {
  return DAPPLE_SHARED_DIR "/" + relative;
}

bool sanitized() {
#ifdef DAPPLE_SANITIZED
  return true;
#else
  return false;
#endif
}

ProcessResult run_dapple(const std::vector<std::string>& arguments, double timeout, const std::string& directory) {
  std::vector<std::string> all{DAPPLE_BINARY};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return run_process(all, timeout, directory);
}

Picture render(const std::string& scene, const std::vector<std::string>& options, double timeout) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr");
  std::vector<std::string> arguments{"render", scene, "-o", image};
  arguments.insert(arguments.end(), options.begin(), options.end());
  if (std::find(options.begin(), options.end(), "--denoise") == options.end())
    arguments.insert(arguments.end(), {"--denoise", "off"});
  const ProcessResult result = run_dapple(arguments, timeout);
  if (result.exit_code == 0) return load_picture(image);
  std::string command = "dapple";
  for (const std::string& a : arguments) command += " " + a;
  throw std::runtime_error(command + (result.timed_out ? "\ntook too long" : "") + "\nexit code " +
                           std::to_string(result.exit_code) + ", signal " + std::to_string(result.signal) + "\n" +
                           result.output);
}

}  // namespace dapple::test
