// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/build/texture_factory.h"
#include "dapple/geom/control_cage.h"
#include "dapple/geom/dicing_view.h"
#include "dapple/shading/material.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// What dicing a shape needs beside the shape.
struct Dicing {
  const TextureLibrary* textures = nullptr;      ///< null: nothing is displaced
  std::shared_ptr<const geom::DicingView> view;  ///< null: a cell a patch
  shading::MaterialPtr shader;                   ///< with a displacement stage; null: none
  float shading_rate = 1;                        ///< where the shape has none of its own
};

/// True if a Shape directive or its shader asks for displacement.
bool is_displaced(const scenefile::ShapeEntity& entity, const Dicing& dicing);
/// Cleans a cage, warns of what was wrong with it, and dices it with the directive's displacement. Null where nothing
/// is left.
trace::GridsPtr dice_cage(const BuildContext& context, const scenefile::ShapeEntity& entity, geom::ControlCage cage,
                          const Dicing& dicing);

}  // namespace dapple::build
