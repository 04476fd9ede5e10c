// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "dapple/modelfile/model_pictures.h"
#include "dapple/scenefile/description_builder.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::modelfile {

/// The pictures that lie over a surface of this material, the most important first; maybe not given.
std::array<const ModelTexture*, 11> pictures_of(const ModelMaterial& m);

/// The named textures and materials that a description gets for the materials of a model. Textures that are alike are
/// one.
class ModelTextures {
 public:
  /// prefix: of all names.
  ModelTextures(const Model& model, std::string prefix, const FileLoc& loc, scenefile::SceneDescription* description,
                scenefile::DescriptionBuilder* builder, ModelPictures* pictures, Diagnostics* diagnostics);

  /// Pictures are this material's from now on. Returns the set of texture coordinates that its shapes have, of which
  /// there is one: that of the colour, else of the first picture.
  uint32_t begin(const ModelMaterial& m);
  /// The file of a picture; nullopt if there is none, if it cannot be read, or if it lies over other coordinates.
  std::optional<std::string> picture(const ModelTexture& t);
  /// Names the scale of a normal map, which is drawn as it is.
  void report_strength(const ModelTexture& t);

  /// Each returns the name that it got.
  std::string define_texture(bool is_spectrum, const std::string& wanted_name, scenefile::Entity entity);
  std::string define_material(const std::string& wanted_name, scenefile::Entity entity);

  // Textures of pictures and of other textures, by name.
  std::string image_map(bool is_spectrum, const ModelTexture& t, const std::string& path, bool is_data, bool weigh);
  std::string scaled(bool is_spectrum, const std::string& texture, const RGB& factor);
  std::string channel(const ModelTexture& t, const std::string& path, int index);
  std::string squared(const std::string& texture);

  const FileLoc& loc() const { return loc_; }
  ModelPictures& pictures() { return pictures_; }
  Diagnostics& diagnostics() { return diagnostics_; }

 private:
  std::string unique(const std::string& name, const char* kind) const;

  const Model& model_;
  const std::string prefix_;
  const FileLoc loc_;
  scenefile::SceneDescription& description_;
  scenefile::DescriptionBuilder& builder_;
  ModelPictures& pictures_;
  Diagnostics& diagnostics_;
  uint32_t uv_set_ = 0;                          // of the material being made
  const ModelMaterial* material_ = nullptr;      // that one
  std::map<std::string, std::string> textures_;  // by what they are
};

}  // namespace dapple::modelfile
