// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/modelfile/model_surface.h"

namespace dapple::modelfile {

/// Defines the material that comes nearest to a surface (docs/guide/models.md has the table): "openpbr" for the
/// metallic kind, mixtures of diffuse, metal and glass for others. Returns its name.
std::string write_look(const ModelMaterial& m, const ModelSurface& s, ModelTextures* textures);

}  // namespace dapple::modelfile
