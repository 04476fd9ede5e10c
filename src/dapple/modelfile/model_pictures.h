// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/image/image.h"
#include "dapple/image/temporary_folder.h"
#include "dapple/modelfile/model.h"

namespace dapple::modelfile {

/// The picture files of a model: those that it names, wherever they lie now, and those inside of it, written to a
/// temporary folder.
class ModelPictures {
 public:
  ModelPictures(const Model& model, const std::string& model_path, const FileLoc& loc, Diagnostics* diagnostics);

  /// The path of a picture that can be read; nullopt, and a warning, for others.
  std::optional<std::string> path(const ModelTexture& texture);
  /// A colour for each corner of each triangle, as a picture of 2 x 2 texels a triangle; places() are its texture
  /// coordinates. Interpolation between texels is that between corners.
  std::string write_corner_colors(const ModelMesh& mesh);
  static std::vector<V2f> corner_places(size_t triangles);

  /// True if a picture has an alpha channel that is not 1 everywhere.
  bool has_alpha(const std::string& path);
  /// True if a picture looks like one of normals in tangent space.
  bool is_normal_map(const std::string& path);

  /// What must live as long as the pictures are read.
  std::shared_ptr<const image::TemporaryFolder> folder() const { return folder_; }

 private:
  std::string find(const std::string& name) const;
  std::string write_image(size_t index);
  image::TemporaryFolder& temporary();

  const Model& model_;
  std::string directory_;
  const FileLoc loc_;
  Diagnostics& diagnostics_;
  std::shared_ptr<image::TemporaryFolder> folder_;
  std::map<std::string, std::optional<std::string>> found_;
  std::map<std::string, bool> alphas_;
  size_t corner_pictures_ = 0;
};

}  // namespace dapple::modelfile
