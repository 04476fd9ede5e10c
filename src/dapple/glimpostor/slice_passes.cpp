// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/slice_passes.h"

#include "dapple/glimpostor/draw_uniforms.h"
#include "dapple/glimpostor/point_shaders.h"
#include "dapple/glimpostor/slice_shaders.h"

namespace dapple::glimpostor {

using depthimage::SampleMask;

SlicePasses::SlicePasses(int side)
    : unshaded_(std::string(draw_list_glsl) + slice_vertex_glsl,
                std::string(limits_glsl) + slab_test_glsl + unshaded_fragment_glsl, {"color"}),
      shaded_(std::string(draw_list_glsl) + slice_vertex_glsl,
              std::string(limits_glsl) + slab_test_glsl + shaded_fragment_glsl, {"color"}) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  const auto attach = [&](const Texture& texture, GLenum place, GLenum inside, GLenum format) {
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexImage2D(GL_TEXTURE_2D, 0, GLint(inside), side, side, 0, format, GL_FLOAT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, place, GL_TEXTURE_2D, texture.name(), 0);
  };
  attach(color_, GL_COLOR_ATTACHMENT0, GL_RGBA16F, GL_RGBA);
  attach(depth_, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GlError("the device draws no half floats into framebuffers");
}

void SlicePasses::draw_pass(const Program& program, Draws draws, const DrawList& list, const Region& region,
                            const SliceTextures& images, uint32_t view, bool shaded) {
  const depthimage::SplatLevel& level = list.object->levels[size_t(list.level)];
  const ViewOfObject seen(draws[list.draws.front()].map, list.object->centre);
  const int slabs = seen.slabs(*list.object, view);
  program.use();
  set_region(program, region);
  set_slices(program, *list.object, level, view, images, slabs);
  draws_.bind(0), slots_.bind(1);
  shaded ? images.bind_normals(2) : images.bind_unshaded(2);
  images.bind_numbers(3);
  const char* const units[] = {"draws", "slots", "image", "numbers"};
  for (int unit = 0; unit < 4; ++unit) glUniform1i(program.at(units[unit]), unit);
  glBindVertexArray(no_vertices_.name());
  glDrawArraysInstanced(GL_TRIANGLES, 0, 6, slabs);
}

void SlicePasses::draw(Draws draws, const DrawList& list, const Region& region, const ColorMatrix* shading,
                       std::vector<float>* rgba, float* largest) {
  const depthimage::SplatLevel& level = list.object->levels[size_t(list.level)];
  const uint32_t view = ViewOfObject(draws[list.draws.front()].map, list.object->centre).best_view(*list.object);
  if (!images_ || images_of_ != std::pair{&level, view})
    images_ = std::make_unique<SliceTextures>(*list.object, level, view), images_of_ = {&level, view};
  *largest = images_->largest();
  const V2i size = (region.pixels.max - region.pixels.min) * SampleMask::side;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, size.x, size.y);
  const GLfloat nothing[] = {0, 0, 0, 0}, deepest = 1;
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_DEPTH, 0, &deepest);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_DEPTH_CLAMP);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
  const uint32_t slot = 0;
  set_draws(draws, list, &draws_);
  slots_.set(GL_R32UI, &slot, sizeof(slot), sizeof(slot));
  draw_pass(unshaded_, draws, list, region, *images_, view, false);
  if (shading) {
    glDepthFunc(GL_EQUAL);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_DST_COLOR, GL_ZERO, GL_ZERO, GL_ONE);
    shaded_.use();
    glUniformMatrix4fv(shaded_.at("color_matrix"), 1, GL_TRUE, &shading->rows[0][0]);
    glUniform4fv(shaded_.at("bias"), 1, shading->bias);
    draw_pass(shaded_, draws, list, region, *images_, view, true);
    glDisable(GL_BLEND);
    glDepthFunc(GL_LESS);
  }
  rgba->resize(size_t(size.x) * size_t(size.y) * 4);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, rgba->data());
}

}  // namespace dapple::glimpostor
