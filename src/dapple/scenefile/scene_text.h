// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "dapple/scenefile/description_builder.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {

/// A scene that grows: read whole, then added to and edited by further text. A failure leaves the description half
/// changed; DescriptionBuilder::checkpoint() is for those who go on after one.
class SceneText {
 public:
  /// Both outlive the object.
  explicit SceneText(Diagnostics& diagnostics, Importer* importer = nullptr);
  ~SceneText();
  SceneText(SceneText&&) noexcept;

  // Once, one of them. Throw InputError.
  void read_file(const std::string& path);
  void read_text(std::string_view text, const std::string& name, const std::string& base_directory);
  /// What was read elsewhere.
  void adopt(SceneDescription description);
  /// Further text, as if it stood at the end. `name` stands in locations. InputError.
  void add(std::string_view text, const std::string& name);

  SceneDescription& description();
  DescriptionBuilder& builder();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dapple::scenefile
