// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "dapple/build/editable_scene.h"

namespace dapple::render {

/// A scene file that is read again when it, or what it names, is saved. Of what is built as much is kept as the
/// difference allows.
class WatchedScene {
 public:
  /// Reads and builds. Errors as build::load_scene(). Diagnostics outlive the object.
  WatchedScene(const std::string& path, const build::BuildOptions& options, Diagnostics& diagnostics);

  build::BuiltScene& built() { return scene_.built(); }

  /// Whether a file was saved, made or removed since the last call of reload().
  bool has_news() const { return stamps() != stamps_; }
  /// Reads the scene again, and makes again what changed; nobody may use built() meanwhile. Returns what that was. An
  /// InputError leaves the scene as it was, until files change once more.
  build::Changes reload();

 private:
  /// Device, number, size and time of each file; what is not there has none.
  using Stamp = std::tuple<uint64_t, uint64_t, int64_t, int64_t, int64_t>;
  using Stamps = std::map<std::string, Stamp>;
  Stamps stamps() const;

  const std::string path_;
  const build::BuildOptions options_;
  Diagnostics& diagnostics_;
  scenefile::SceneDescription description_;
  build::EditableScene scene_;
  Stamps stamps_;  ///< when it was looked at last
  Stamps built_;   ///< of what is built: what changed before an error still counts
};

}  // namespace dapple::render
