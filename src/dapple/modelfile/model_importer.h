// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/base/transform.h"
#include "dapple/modelfile/model.h"
#include "dapple/modelfile/model_reader.h"
#include "dapple/scenefile/description_builder.h"

namespace dapple::modelfile {

/// What emit_model() has made of a model.
struct Emitted {
  size_t shapes = 0, lights = 0, emitters = 0;
};

/// Adds a model to a description, under the builder's transform: named materials (names begin with `prefix`), textures,
/// shapes, objects for what is used more than once, and lights. `file`, a name in SceneDescription::files, stands for
/// all places. What is left out is named. Inside of an object definition all are shapes of it, and lights are left out.
Emitted emit_model(Model model, const std::string& file, const std::string& prefix, const FileLoc& loc,
                   scenefile::SceneDescription* description, scenefile::DescriptionBuilder* builder,
                   Diagnostics* diagnostics);

/// Import of models in scene files, as they are in their files.
class ModelImporter final : public scenefile::Importer {
 public:
  bool reads(const std::string& path) const override { return is_model_file(path); }
  void import(const std::string& path, const FileLoc& loc, scenefile::SceneDescription* description,
              scenefile::DescriptionBuilder* builder, Diagnostics* diagnostics) override;
};

}  // namespace dapple::modelfile
