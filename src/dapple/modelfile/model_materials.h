// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "dapple/modelfile/model_textures.h"

namespace dapple::modelfile {

/// What the shapes of a material need beside its name.
struct ShapeLook {
  std::string material;  ///< a named material
  std::optional<scenefile::Param> alpha;
  std::optional<scenefile::Entity> emission;  ///< an AreaLightSource
  uint32_t uv_set = 0;
};

/// Turns the materials of a model into named materials and textures of a description, as they are asked for
/// (docs/guide/models.md has the table).
class ModelMaterials {
 public:
  ModelMaterials(const Model& model, std::string prefix, const FileLoc& loc, scenefile::SceneDescription* description,
                 scenefile::DescriptionBuilder* builder, ModelPictures* pictures, Diagnostics* diagnostics);

  /// The look of a mesh: its material, in the colours of its vertices if it has them. With `corner_colors`, texture
  /// coordinates of the shape must be ModelPictures::corner_places().
  ShapeLook look(const ModelMesh& mesh, bool corner_colors);
  /// True if the colours of its vertices differ, and no picture is in their way.
  bool wants_corner_colors(const ModelMesh& mesh) const;

 private:
  ShapeLook make(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture);
  void add_alpha(const ModelMaterial& m, ShapeLook* look);
  void add_emission(const ModelMaterial& m, ShapeLook* look);

  const Model& model_;
  ModelTextures textures_;
  std::map<std::tuple<uint32_t, float, float, float>, ShapeLook> looks_;
};

}  // namespace dapple::modelfile
