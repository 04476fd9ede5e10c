// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <tuple>
#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// How much of the light a shape stops, as GeometryBinding has it. Null: all.
struct ShapeOpacity {
  pattern::FloatTexturePtr alpha;
  pattern::RgbTexturePtr colored;
  bool operator==(const ShapeOpacity&) const = default;
};

/// Makes that of a shape's alpha, its opacity by channel, and its shader where that has such a stage. Shapes of equal
/// ones share it.
class OpacityFactory {
 public:
  /// All must outlive this object.
  OpacityFactory(const BuildContext& context, const TextureLibrary& textures,
                 const std::vector<shading::MaterialPtr>& materials)
      : context_(context), textures_(textures), materials_(materials) {}

  ShapeOpacity make(const scenefile::ShapeEntity& e);

 private:
  const BuildContext& context_;
  const TextureLibrary& textures_;
  const std::vector<shading::MaterialPtr>& materials_;
  std::map<std::tuple<shading::MaterialPtr, pattern::RgbTexturePtr, pattern::FloatTexturePtr>, ShapeOpacity> made_;
};

}  // namespace dapple::build
