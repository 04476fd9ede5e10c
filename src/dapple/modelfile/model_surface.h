// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/modelfile/model_textures.h"

namespace dapple::modelfile {

/// The quantities of a surface, each a number or a texture of that name times it.
struct ModelSurface {
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

/// Of a material of any kind, times `tint`; corner_picture: the colour's where the material has none, or empty. What is
/// not drawn is reported. After ModelTextures::begin(m).
ModelSurface surface_of(const ModelMaterial& m, const RGB& tint, const std::string& corner_picture,
                        ModelTextures* textures);

}  // namespace dapple::modelfile
