// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

namespace dapple::test {

/// The channels of all parts of an EXR as float, and texts, numbers and matrices of its first header. Read with
/// OpenImageIO directly. std::runtime_error where a file, channel or text is not there.
class ExrLayers {
 public:
  explicit ExrLayers(const std::string& path);

  int width() const { return width_; }
  int height() const { return height_; }
  int parts() const { return parts_; }
  std::vector<std::string> names() const;  ///< in order of the alphabet
  bool has(const std::string& channel) const { return values_.count(channel) > 0; }
  const std::vector<float>& operator[](const std::string& channel) const;
  std::string type(const std::string& channel) const;  ///< "half", "float", "uint"
  std::string text(const std::string& attribute) const;

 private:
  int width_ = 0, height_ = 0, parts_ = 0;
  std::map<std::string, std::vector<float>> values_;
  std::map<std::string, std::string> types_, texts_;
};

}  // namespace dapple::test
