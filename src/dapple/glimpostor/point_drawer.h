// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>

#include "dapple/glimpostor/drawer.h"
#include "dapple/glimpostor/level_buffers.h"

namespace dapple::glimpostor {

/// Each fragment as a parallelogram on its plane, of which its mask keeps what it covers.
class PointDrawer final : public Drawer {
 public:
  PointDrawer();

  void draw(Draws draws, const DrawList& list, const Region& region) override;
  uint64_t binds() const override { return binds_; }
  size_t bytes() const override { return bytes_; }

 private:
  Program program_;
  VertexArray no_vertices_;
  BufferTexture draws_, instances_;
  std::map<const depthimage::SplatLevel*, std::unique_ptr<LevelBuffers>> levels_;
  uint64_t binds_ = 0;
  size_t bytes_ = 0;
};

}  // namespace dapple::glimpostor
