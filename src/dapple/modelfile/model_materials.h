// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "dapple/modelfile/model_pictures.h"
#include "dapple/scenefile/description_builder.h"
#include "dapple/scenefile/scene_description.h"

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
  /// The quantities of a surface, each a number or a texture of that name times it.
  struct Surface {
    RGB color{0.8f};
    std::string color_map;
    float alpha = 1;  ///< GGX's
    std::string alpha_map;
    float metalness = 0;
    std::string metalness_map;
    float transmission = 0;
    std::string transmission_map;
    bool has_highlight = true;
    std::optional<RGB> mirror;  ///< colour of a metal, where it is not `color`
    std::string normal_map;
  };

  ShapeLook make(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture);
  std::string unique(const std::string& name, const char* kind) const;
  std::string texture(bool is_spectrum, const std::string& name, scenefile::Entity entity);
  std::string define(const std::string& name, scenefile::Entity entity);
  std::string image_map(bool is_spectrum, const ModelTexture& t, const std::string& path, bool is_data, bool weigh);
  std::string scaled(bool is_spectrum, const std::string& texture, const RGB& factor);
  std::string channel(const ModelTexture& t, const std::string& path, int index);
  std::string squared(const std::string& texture);

  Surface surface_of(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture);
  void add_alpha(const ModelMaterial& m, ShapeLook* look);
  void add_emission(const ModelMaterial& m, ShapeLook* look);
  bool is_clear_pane(const ModelMaterial& m, const Surface& s) const;
  std::string principled(const ModelMaterial& m, const Surface& s, const std::string& name);
  std::string diffuse_base(const ModelMaterial& m, const Surface& s, const std::string& name);
  std::string metal(const Surface& s, const std::string& name);
  std::string glass(const ModelMaterial& m, const Surface& s, const std::string& name);
  std::string mixed(const std::string& first, const std::string& second, double amount,
                    const std::string& amount_texture, const std::string& name);
  uint32_t choose_uv_set(const ModelMaterial& m) const;
  std::optional<std::string> picture(const ModelTexture& t);

  const Model& model_;
  const std::string prefix_;
  const FileLoc loc_;
  scenefile::SceneDescription& description_;
  scenefile::DescriptionBuilder& builder_;
  ModelPictures& pictures_;
  Diagnostics& diagnostics_;
  uint32_t uv_set_ = 0;                      // of the material being made
  const ModelMaterial* material_ = nullptr;  // that one
  std::map<std::tuple<uint32_t, float, float, float>, ShapeLook> looks_;
  std::map<std::string, std::string> textures_;  // by what they are
};

}  // namespace dapple::modelfile
