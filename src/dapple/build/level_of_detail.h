// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/build/camera_view.h"
#include "dapple/scene/scene.h"

namespace dapple::build {

/// To how many pixels what pruning keeps may grow (vegetation/aggregate_pruning.h), by "off" (0), "auto" or a number
/// above 0 and up to 64. None for other text.
std::optional<float> level_of_detail(std::string_view text);
/// For messages: what level_of_detail() takes.
inline constexpr const char* expected_level_of_detail =
    "expected \"off\", \"auto\" or pixels above 0 and up to 64, such as \"0.5\"";
/// What Option "string lod" says; "off" by default. Throws InputError.
float scene_level_of_detail(const BuildContext& context);

/// Who sees the meshes that may be pruned, from how near: the dicing camera at both ends of the shutter, through the
/// nearest instances at both ends of their motion.
class LevelOfDetail {
 public:
  /// With 0 pixels nothing may be pruned.
  LevelOfDetail(const BuildContext& context, const scene::Scene& scene, const scene::Camera& dicing_camera,
                float pixels);

  float pixels() const { return pixels_; }
  /// Null where the shape is not to be pruned: what shines, fills or bounds a medium, is no mesh, or says
  /// "bool lod" false. `object`: the definition that it stands in; without a value it stands in the scene itself. Not
  /// for shapes that move by themselves in a definition, which are never pruned.
  std::shared_ptr<const geom::DicingView> view_of(const scenefile::ShapeEntity& entity,
                                                  std::optional<size_t> object) const;
  /// The same of a shape that moves by itself in the scene.
  std::shared_ptr<const geom::DicingView> view_of(const scenefile::ShapeEntity& entity,
                                                  const scenefile::TransformPair& motion) const;

 private:
  bool may_be_pruned(const scenefile::ShapeEntity& entity) const;

  const BuildContext& context_;
  const float pixels_;
  std::vector<uint8_t> stays_;                                         ///< by material: it shines, or bounds a medium
  std::vector<std::shared_ptr<const CameraView>> cameras_;             ///< at shutter open, and where it moves at close
  std::shared_ptr<const geom::DicingView> world_;                      ///< as these see it
  std::vector<std::shared_ptr<const geom::DicingView>> object_views_;  ///< null: it is placed nowhere
};

}  // namespace dapple::build
