// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dapple/build/texture_params.h"
#include "dapple/image/texture_system.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// The picture by which a shape is cut out: the image that its `alpha` or `opacity` is. Colours that are pictures of
/// the same size over the same mapping are filtered weighted by it: what is cut away has no colour.
struct Coverage {
  image::TextureWeight weight;
  std::string mapping;  ///< what must be equal for a texel of one picture to lie on that of the other
  friend bool operator==(const Coverage&, const Coverage&) = default;
};

/// Of an imagemap texture: a text that is equal for equal mappings and wraps.
std::string mapping_of(const scenefile::TextureEntity& entity);

/// By what the colours of an imagemap texture are weighted. `coverage` is that of the shape, or null. InputError if a
/// file cannot be read.
image::TextureWeight texture_weight(const scenefile::TextureEntity& entity, const ImageParams& image,
                                    const Coverage* coverage);

/// Materials of a scene for shapes that are cut out by pictures: of each material and picture that belong together, one
/// more.
class CoverageMaterials {
 public:
  /// Appends to `materials`, which are those of the description so far.
  CoverageMaterials(const BuildContext& context, std::vector<shading::MaterialPtr>* materials);
  /// Index of the shape's material.
  uint32_t material_of(const scenefile::ShapeEntity& e) const;

 private:
  std::optional<Coverage> coverage_of(const scenefile::ShapeEntity& e) const;
  std::string picture_name(const scenefile::ShapeEntity& e) const;

  const BuildContext& context_;
  std::map<std::pair<scenefile::MaterialIndex, std::string>, uint32_t> made_;  ///< by material and picture_name()
};

}  // namespace dapple::build
