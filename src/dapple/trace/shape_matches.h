// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/trace/traced_scene.h"

namespace dapple::trace {

/// Which shapes and instances of another scene are those of this one, such as the scene of the next frame: points of
/// this one have their places there by the same primitive and the same u and v.
///
/// What both scenes name (ItemNames) corresponds by its name: objects with half of their kinds of shapes in common, and
/// in them, among those of one kind, shapes and instances. A name that only one scene has matches nothing.
///
/// The rest corresponds in its order: shapes among those of one kind that have equally many primitives, joined in the
/// same way, or of one name. Where there are more or fewer of these, the equal ones correspond, in their
/// order, and the others have no match. A shape that is placed once, as those that move are, counts like one that is
/// not placed, but within what bears its object's name.
///
/// Shapes of objects that are placed more often, in one of the scenes at least, correspond within their object, and so
/// do its instances. Other objects correspond where their shapes are equal, in their order, if these are
/// equally many. What TracedScene::add_placements() placed corresponds if it is all the same there.
class ShapeMatches {
 public:
  /// Both are committed. They may go afterwards.
  ShapeMatches(const TracedScene& here, const TracedScene& there);

  /// Renames what hit i of this scene met as the other has it. False, and as it was, where that has none.
  bool rename(HitBatch* hits, int i) const;
  /// Of this scene, those that have no match.
  size_t lost_shapes() const;
  size_t lost_instances() const;

  /// A shape, and its only instance; no_id: none, or many.
  struct Place {
    uint32_t geometry = no_id, instance = no_id;
  };

 private:
  bool is_single(uint32_t instance) const { return instance < single_.size() && single_[instance]; }

  std::vector<Place> place_;        ///< by geometry of this scene
  std::vector<uint32_t> instance_;  ///< by that of this scene; no_id: none
  std::vector<bool> single_;        ///< by instance: the only one of its object
  size_t placed_ = 0;               ///< instances of placements
  uint32_t first_placed_there_ = 0;
  bool same_placements_ = false;
};

}  // namespace dapple::trace
