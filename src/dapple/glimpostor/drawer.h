// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/depthimage/splat_tile.h"

namespace dapple::glimpostor {

/// A part of the film, and how its sub-samples lie.
struct Region {
  Box2i pixels;
  V2f jitter{0.5f, 0.5f};
  uint32_t round = 0;
  float nearest = 0, farthest = 0;  ///< depths of what is drawn
  bool perspective = true;
};

using Draws = std::span<const depthimage::SplatTile::Draw>;

/// What is drawn of a level of an object, by its textures bound once.
struct DrawList {
  struct Chunk {
    uint32_t slot, chunk;  ///< of `draws`; of the level
  };
  const depthimage::SplatObject* object = nullptr;
  int level = 0;
  std::vector<uint32_t> draws;  ///< by number
  std::vector<Chunk> chunks;
};

/// Draws lists into the current framebuffer. Holds objects of OpenGL: lives while a context is current.
class Drawer {
 public:
  virtual ~Drawer() = default;
  virtual void draw(Draws draws, const DrawList& list, const Region& region) = 0;
  virtual uint64_t binds() const = 0;  ///< of textures, so far
  virtual size_t bytes() const = 0;    ///< on the device
};

}  // namespace dapple::glimpostor
