// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/point_drawer.h"

#include "dapple/glimpostor/draw_uniforms.h"
#include "dapple/glimpostor/point_shaders.h"

namespace dapple::glimpostor {

PointDrawer::PointDrawer()
    : program_(std::string(draw_list_glsl) + point_vertex_glsl, std::string(limits_glsl) + point_fragment_glsl,
               {"shown", "distance_along"}) {}

void PointDrawer::draw(Draws draws, const DrawList& list, const Region& region) {
  const depthimage::SplatLevel& level = list.object->levels[size_t(list.level)];
  std::unique_ptr<LevelBuffers>& buffers = levels_[&level];
  if (!buffers) {
    buffers = std::make_unique<LevelBuffers>(level);
    bytes_ += buffers->bytes();
  }
  set_draws(draws, list, &draws_);
  instances_.set(GL_RG32UI, list.chunks.data(), list.chunks.size() * sizeof(DrawList::Chunk), sizeof(DrawList::Chunk));
  program_.use();
  set_region(program_, region);
  draws_.bind(0), instances_.bind(1), buffers->bind(2);
  ++binds_;
  glUniform1i(program_.at("draws"), 0);
  glUniform1i(program_.at("instances"), 1);
  glUniform1i(program_.at("fragments"), 2);
  glUniform1f(program_.at("texel"), level.texel);
  std::vector<float> axes;
  for (const depthimage::ViewFrame& frame : list.object->frames)
    for (const V3f& axis : {frame.u, frame.v, frame.w}) axes.insert(axes.end(), {axis.x, axis.y, axis.z});
  glUniform3fv(program_.at("frames"), GLsizei(axes.size() / 3), axes.data());
  glBindVertexArray(no_vertices_.name());
  glDrawArraysInstanced(GL_TRIANGLES, 0, 6 * depthimage::SplatLevel::chunk_size, GLsizei(list.chunks.size()));
}

}  // namespace dapple::glimpostor
