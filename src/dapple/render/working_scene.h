// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/build/editable_scene.h"
#include "dapple/modelfile/model_importer.h"
#include "dapple/scenefile/scene_text.h"

namespace dapple::render {

/// A scene that is changed and built again: its description, what is built of it, and the record of all changes. Not
/// for two threads at a time.
class WorkingScene {
 public:
  /// A scene file or a model; an empty path is an empty scene. Throws InputError.
  WorkingScene(const std::string& path, const build::BuildOptions& options, bool strict);
  /// A scene in memory, whose files are relative to `folder`.
  WorkingScene(const std::string& text, const std::string& folder, const build::BuildOptions& options, bool strict);

  // All of a change or, with an InputError, nothing. What takes part in it is found to be wrong later, in built().
  /// `params`: as text of the scene language.
  void edit(scenefile::EditTarget target, const std::string& name, const std::string& params);
  void remove(scenefile::EditTarget target, const std::string& name);
  /// Text of the scene language; `touched` tells what it can have touched.
  void add(const std::string& text, const build::Changes& touched);
  /// Text in pieces, between which stand large parameters of shapes, which become no text until the scene is written.
  struct Piece {
    std::string text;
    scenefile::Param param{};  ///< after it; none, if it has no name. Its type is that of `declaration`
    std::string declaration{};
    int shape = 0;  ///< of those in the text, in the order in which they end
  };
  void add(std::vector<Piece> pieces, const std::string& object, const build::Changes& touched);
  /// Dices for the camera as it is from now on.
  void freeze_dicing_camera();

  struct Checkpoint {
    std::shared_ptr<const scenefile::DescriptionBuilder::Checkpoint> description;
    size_t record;
    build::Changes changes;
  };
  /// What restore() goes back to, until the scene is built.
  Checkpoint checkpoint() { return {text_->builder().checkpoint(), record_.size(), changes_}; }
  void restore(const Checkpoint& checkpoint);

  /// The scene with all changes. An error takes back what was changed since it was built last, if it ever was; then the
  /// scene and what is built of it are as they were.
  build::BuiltScene& built(const build::FilmOverrides& film);
  build::BuiltScene& built() { return built(options_.film); }
  /// As build::EditableScene, of a scene that was built.
  std::vector<RGB> described_gains() const { return built_->described_gains(); }
  build::IntegratorRequest described_request() const { return built_->described_request(); }
  /// What has changed since built() was called last.
  const build::Changes& changes() const { return changes_; }
  /// What the last call of built() made again.
  const build::Changes& made_again() const { return made_again_; }
  double build_seconds() const { return build_seconds_; }  ///< of that

  /// The file that was read, or the text, and all changes: see docs/guide/scenes.md, Edits. IoError; UsageError for a
  /// model, which Include cannot read.
  std::string written(const std::string& path) const;

  scenefile::SceneEditor& editor() { return text_->builder().editor(); }
  const scenefile::SceneDescription& description() const { return text_->description(); }
  const Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  void check_files(scenefile::EditTarget target, const std::string& name);
  void change(const std::function<void()>& work, std::function<std::string()> text, const build::Changes& touched);
  std::string next_name();

  Diagnostics diagnostics_;
  build::BuildOptions options_;
  modelfile::ModelImporter importer_;
  std::unique_ptr<scenefile::SceneText> text_;
  std::string beginning_;  ///< what the written text begins with, if that is no file
  bool is_file_ = false, is_model_ = false;
  std::vector<std::function<std::string()>> record_;
  build::Changes changes_;
  std::optional<build::EditableScene> built_;
  build::Changes made_again_;
  double build_seconds_ = 0;
  std::shared_ptr<const scenefile::DescriptionBuilder::Checkpoint> good_;
  size_t good_record_ = 0;
  int edits_ = 0;
};

}  // namespace dapple::render
