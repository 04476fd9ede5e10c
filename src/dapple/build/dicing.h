// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/build/texture_factory.h"
#include "dapple/geom/control_cage.h"
#include "dapple/geom/dicing_view.h"
#include "dapple/shading/material.h"
#include "dapple/trace/traced_scene.h"
#include "dapple/vegetation/aggregate_pruning.h"

namespace dapple::build {

class DicePlan;

/// What making a shape needs beside the shape.
struct Dicing {
  const TextureLibrary* textures = nullptr;                ///< null: nothing is displaced
  std::shared_ptr<const geom::DicingView> view;            ///< null: a cell a patch
  shading::MaterialPtr shader;                             ///< with a displacement stage; null: none
  float shading_rate = 1;                                  ///< where the shape has none of its own
  int most_levels = 64;                                    ///< of Loop subdivision that is not diced
  std::shared_ptr<const geom::DicingView> pruning_view{};  ///< null: meshes are not pruned
  float pruning_pixels = 0;
  vegetation::PruningCounts* pruned = nullptr;  ///< with a pruning_view: where what was pruned is added
  /// Where not null, a shape that is diced leaves its plan here, and make_shapes() returns none.
  std::unique_ptr<DicePlan>* plan = nullptr;
};

/// True if a Shape directive or its shader asks for displacement.
bool is_displaced(const scenefile::ShapeEntity& entity, const Dicing& dicing);
/// A shape that is measured and not yet diced, so that a scene of many is known to fit the memory before any takes it.
class DicePlan {
 public:
  virtual ~DicePlan() = default;
  /// Takes levels off what the view asks for; all levels ever taken, not more each time. Returns the vertices there
  /// would be.
  virtual size_t coarsen(int levels) = 0;
  /// Called once. Null where nothing is left of the shape.
  virtual trace::GridsPtr dice() = 0;
};

/// Cleans a cage, warns of what was wrong with it, and measures it for dicing with the directive's displacement. Null
/// where nothing is left. The context and the directive outlive the plan.
std::unique_ptr<DicePlan> plan_cage(const BuildContext& context, const scenefile::ShapeEntity& entity,
                                    geom::ControlCage cage, const Dicing& dicing);

/// Coarsens, all alike, those plans that want more than their share of `most_vertices`, until all together have no
/// more. Returns the levels, and in *first the number of the first plan that they were taken off. Plans may be null.
int fit_plans(const std::vector<std::unique_ptr<DicePlan>>& plans, size_t most_vertices, size_t* first);

}  // namespace dapple::build
