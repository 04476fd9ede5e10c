// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/slice_drawer.h"

#include <algorithm>

#include "dapple/glimpostor/draw_uniforms.h"
#include "dapple/glimpostor/point_shaders.h"
#include "dapple/glimpostor/slice_shaders.h"

namespace dapple::glimpostor {

using depthimage::ScreenMap;
using depthimage::SplatLevel;
using depthimage::SplatObject;

ViewOfObject::ViewOfObject(const ScreenMap& map, const V3f& centre) {
  // Along the line of sight nothing moves on the film.
  const V2f at = map.film(centre);
  const float W = map.apply(ScreenMap::W, centre);
  const auto row = [&](ScreenMap::Row r, float place) {
    return V3f(map.m[r][0] - place * map.m[ScreenMap::W][0], map.m[r][1] - place * map.m[ScreenMap::W][1],
               map.m[r][2] - place * map.m[ScreenMap::W][2]);
  };
  const V3f x = row(ScreenMap::X, at.x), y = row(ScreenMap::Y, at.y), along = cross(x, y);
  if (!(length2(along) > 0)) return;
  to_viewer = normalize(along);
  if (map.apply_vector(ScreenMap::Z, to_viewer) > 0) to_viewer = -to_viewer;
  pixels = std::max(length(x), length(y)) / std::max(W, 1e-20f);
}

uint32_t ViewOfObject::best_view(const SplatObject& object) const {
  uint32_t best = 0;
  for (uint32_t v = 1; v < object.frames.size(); ++v)
    if (dot(object.frames[v].w, to_viewer) > dot(object.frames[best].w, to_viewer)) best = v;
  return best;
}

int ViewOfObject::slabs(const SplatObject& object, uint32_t view) const {
  const float cosine = std::clamp(dot(object.frames[view].w, to_viewer), 0.1f, 1.0f);
  const float shift = 2 * object.radius * std::sqrt(1 - cosine * cosine) * pixels;
  return std::clamp(int(std::ceil(shift / (2 * SliceNumbers::parallax))), 1, SliceNumbers::most_slabs);
}

SliceDrawer::SliceDrawer()
    : program_(std::string(draw_list_glsl) + slice_vertex_glsl,
               std::string(limits_glsl) + slab_test_glsl + slice_fragment_glsl, {"shown", "distance_along"}) {}

const SliceTextures& SliceDrawer::textures(const DrawList& list, uint32_t view) {
  const SplatLevel& level = list.object->levels[size_t(list.level)];
  std::unique_ptr<SliceTextures>& held = textures_[{&level, view}];
  if (!held) {
    held = std::make_unique<SliceTextures>(*list.object, level, view);
    bytes_ += held->bytes();
  }
  return *held;
}

void set_slices(const Program& program, const SplatObject& object, const SplatLevel& level, uint32_t view,
                const SliceTextures& textures, int slabs) {
  const auto set = [&](const char* name, const V3f& v) { glUniform3f(program.at(name), v.x, v.y, v.z); };
  set("centre", object.centre);
  set("axis_u", object.frames[view].u * object.radius);
  set("axis_v", object.frames[view].v * object.radius);
  set("axis_w", object.frames[view].w * object.radius);
  glUniform1i(program.at("slabs"), slabs);
  glUniform1i(program.at("layers"), textures.layers());
  glUniform1f(program.at("half_slab"), 0.5f / float(slabs) + SliceNumbers::overlap * level.texel / (2 * object.radius));
}

void SliceDrawer::draw(Draws draws, const DrawList& list, const Region& region) {
  set_draws(draws, list, &draws_);
  program_.use();
  set_region(program_, region);
  glUniform1i(program_.at("draws"), 0);
  glUniform1i(program_.at("slots"), 1);
  glUniform1i(program_.at("image"), 2);
  glUniform1i(program_.at("numbers"), 3);
  glBindVertexArray(no_vertices_.name());
  std::vector<std::vector<uint32_t>> slots(list.object->frames.size());
  std::vector<int> slabs(slots.size(), 1);
  for (uint32_t slot = 0; slot < list.draws.size(); ++slot) {
    const ViewOfObject seen(draws[list.draws[slot]].map, list.object->centre);
    const uint32_t best = seen.best_view(*list.object);
    slots[best].push_back(slot);
    slabs[best] = std::max(slabs[best], seen.slabs(*list.object, best));
  }
  for (uint32_t v = 0; v < slots.size(); ++v) {
    if (slots[v].empty()) continue;
    const SliceTextures& images = textures(list, v);
    slots_.set(GL_R32UI, slots[v].data(), slots[v].size() * sizeof(uint32_t), sizeof(uint32_t));
    draws_.bind(0), slots_.bind(1);
    images.bind_unshaded(2), images.bind_numbers(3);
    ++binds_;
    set_slices(program_, *list.object, list.object->levels[size_t(list.level)], v, images, slabs[v]);
    glDrawArraysInstanced(GL_TRIANGLES, 0, 6, GLsizei(slots[v].size()) * slabs[v]);
  }
}

}  // namespace dapple::glimpostor
