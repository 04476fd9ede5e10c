// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/slice_textures.h"

#include <algorithm>
#include <array>
#include <vector>

namespace dapple::glimpostor {

using depthimage::SplatLevel;
using depthimage::SplatObject;

namespace {

struct Layered {
  uint32_t fragment;
  float depth;  // 0 near, 1 far
};

using Texels = std::vector<std::vector<Layered>>;  // by texel, front to back

Texels sort_into_texels(const SplatObject& object, const SplatLevel& level, uint32_t view, int resolution) {
  Texels texels(size_t(resolution) * size_t(resolution));
  const depthimage::ViewFrame& frame = object.frames[view];
  for (size_t c = 0; c < level.chunks.size(); ++c) {
    if (level.chunks[c].view != view) continue;
    for (uint32_t i = 0; i < level.chunks[c].count; ++i) {
      const SplatLevel::Lanes& from = level.lanes[c];
      const V3f P = V3f(from.x[i], from.y[i], from.z[i]) - object.centre;
      const auto place = [&](const V3f& axis) {
        return std::clamp(int((dot(P, axis) + object.radius) / level.texel), 0, resolution - 1);
      };
      const size_t texel = size_t(place(frame.v)) * size_t(resolution) + size_t(place(frame.u));
      texels[texel].push_back({uint32_t(c) * SplatLevel::chunk_size + i,
                               std::clamp(0.5f - dot(P, frame.w) / (2 * object.radius), 0.0f, 1.0f)});
    }
  }
  for (auto& texel : texels)
    std::stable_sort(texel.begin(), texel.end(), [](const Layered& a, const Layered& b) { return a.depth < b.depth; });
  return texels;
}

uint8_t byte(float share) {
  return uint8_t(std::lround(255 * std::clamp(share, 0.0f, 1.0f)));
}

void upload(const Texture& texture, GLenum inside, GLenum format, GLenum type, int side, int layers, const void* data) {
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GLint(inside), side, side, layers, 0, format, type, data);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

}  // namespace

SliceTextures::SliceTextures(const SplatObject& object, const SplatLevel& level, uint32_t view)
    : resolution_(int(std::lround(2 * object.radius / level.texel))) {
  const Texels texels = sort_into_texels(object, level, view, resolution_);
  for (const auto& texel : texels) layers_ = std::max(layers_, int(texel.size()));
  layers_ = std::clamp(layers_, 1, most_layers);
  for (const auto& m : object.materials)
    for (int c = 0; c < 3; ++c) largest_ = std::max(largest_, m.reflectance[c] + m.transmittance[c]);
  const size_t per_layer = texels.size(), count = per_layer * size_t(layers_);
  std::vector<std::array<uint8_t, 4>> unshaded(count), normals(count);
  std::vector<std::array<uint32_t, 2>> numbers(count);
  for (size_t t = 0; t < texels.size(); ++t)
    for (size_t l = 0; l < std::min(texels[t].size(), size_t(layers_)); ++l) {
      const Layered& from = texels[t][l];
      const SplatObject::Surface s = object.surface(level, view, from.fragment);
      const V3f n = face_forward(s.normal, object.frames[view].w);
      const size_t to = l * per_layer + t;
      const auto alpha = uint8_t(1 + std::lround(254 * (1 - from.depth)));
      for (int c = 0; c < 3; ++c) {
        unshaded[to][size_t(c)] = byte((s.reflectance[c] + s.transmittance[c]) / std::max(largest_, 1e-6f));
        normals[to][size_t(c)] = byte(0.5f * (n[c] + 1));
      }
      unshaded[to][3] = normals[to][3] = alpha;
      numbers[to] = {from.fragment, level.fragments[from.fragment].mask};
    }
  upload(unshaded_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, resolution_, layers_, unshaded.data());
  upload(normals_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, resolution_, layers_, normals.data());
  upload(numbers_, GL_RG32UI, GL_RG_INTEGER, GL_UNSIGNED_INT, resolution_, layers_, numbers.data());
  bytes_ = count * (sizeof(unshaded[0]) + sizeof(normals[0]) + sizeof(numbers[0]));
}

void SliceTextures::bind(const Texture& texture, int unit) {
  glActiveTexture(GLenum(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
}

}  // namespace dapple::glimpostor
