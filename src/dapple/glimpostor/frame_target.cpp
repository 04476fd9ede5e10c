// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/frame_target.h"

namespace dapple::glimpostor {

using depthimage::SampleMask;
using impostor::SubSamples;

FrameTarget::FrameTarget(int side) : side_(side) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  const auto attach = [&](const Texture& texture, GLenum place, GLenum inside, GLenum format, GLenum type) {
    glBindTexture(GL_TEXTURE_2D, texture.name());
    glTexImage2D(GL_TEXTURE_2D, 0, GLint(inside), side, side, 0, format, type, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, place, GL_TEXTURE_2D, texture.name(), 0);
  };
  attach(shown_, GL_COLOR_ATTACHMENT0, GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT);
  attach(distance_, GL_COLOR_ATTACHMENT1, GL_R32F, GL_RED, GL_FLOAT);
  attach(depth_, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw GlError("the device draws no whole numbers into framebuffers");
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
}

void FrameTarget::begin(const Box2i& pixels) {
  const V2i size = (pixels.max - pixels.min) * SampleMask::side;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  const GLenum both[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glDrawBuffers(2, both);
  glViewport(0, 0, size.x, size.y);
  const GLuint none[] = {SubSamples::none, 0, 0, 0};
  const GLfloat far_away[] = {infinity, 0, 0, 0}, deepest = 1;
  glClearBufferuiv(GL_COLOR, 0, none);
  glClearBufferfv(GL_COLOR, 1, far_away);
  glClearBufferfv(GL_DEPTH, 0, &deepest);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_DEPTH_CLAMP);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
}

void FrameTarget::read(const Box2i& pixels, SubSamples* to) {
  const V2i size = (pixels.max - pixels.min) * SampleMask::side, at = (pixels.min - to->pixels.min) * SampleMask::side;
  const size_t count = size_t(size.x) * size_t(size.y);
  ids_.resize(2 * count), depths_.resize(count);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, size.x, size.y, GL_RG_INTEGER, GL_UNSIGNED_INT, ids_.data());
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, size.x, size.y, GL_RED, GL_FLOAT, depths_.data());
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x) {
      const size_t from = size_t(y) * size_t(size.x) + size_t(x),
                   place = size_t(at.y + y) * to->width() + size_t(at.x + x);
      to->draw[place] = ids_[2 * from], to->fragment[place] = ids_[2 * from + 1], to->depth[place] = depths_[from];
    }
}

}  // namespace dapple::glimpostor
