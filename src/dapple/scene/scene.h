// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/emitters/light.h"
#include "dapple/emitters/light_sampler.h"
#include "dapple/pattern/texture.h"
#include "dapple/scene/camera.h"
#include "dapple/scene/film.h"
#include "dapple/scene/filter.h"
#include "dapple/scene/glow_table.h"
#include "dapple/scene/light_groups.h"
#include "dapple/scene/patch_memory.h"
#include "dapple/shading/material.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::media {
class Medium;
}

namespace dapple::scene {

inline constexpr int32_t vacuum = -1;

/// What belongs to a traced geometry beside its shape.
struct GeometryBinding {
  int32_t material = 0;
  /// Place in Scene::light_table of primitive 0's light; no_id: emits nothing.
  uint32_t first_light = trace::no_id;
  pattern::FloatTexturePtr alpha;  ///< null = opaque
  pattern::RgbTexturePtr opacity;  ///< where it differs by channel: `alpha` is its mean. null = it does not
  int32_t inside_medium = vacuum, outside_medium = vacuum;
  bool changes_medium = false;  ///< the surface separates the two media above

  /// The medium on a side of a surface that separates two, else `otherwise`: that of whoever comes to it.
  int32_t medium_at(bool inside, int32_t otherwise) const {
    return !changes_medium ? otherwise : inside ? inside_medium : outside_medium;
  }
  /// The medium that a ray along d is in after it left the surface of normal Ng, having been in `before`.
  int32_t medium_beyond(const V3f& d, const V3f& Ng, int32_t before) const {
    return !changes_medium ? before : dot(d, Ng) < 0 ? inside_medium : outside_medium;
  }
};

/// A scene made ready for rendering: frozen, shared by all threads, free of file syntax.
class Scene final : public trace::OpacityTest {
 public:
  /// `like`: of TracedScene.
  explicit Scene(const Scene* like = nullptr)
      : traced(like ? &like->traced : nullptr), patches(like ? like->patches : nullptr) {
    if (!patches) patches = std::make_shared<PatchMemory>();
    traced.set_opacity_test(this);
  }

  trace::TracedScene traced;
  /// What shapes are cut into, for all that ask, and for the scene that is like this one.
  std::shared_ptr<PatchMemory> patches;
  std::vector<GeometryBinding> bindings;  ///< by geometry
  std::vector<shading::MaterialPtr> materials;
  std::vector<std::unique_ptr<const emitters::Light>> lights;
  std::vector<uint32_t> light_table;  ///< primitive's light, no_id where it has none (zero area)
  std::vector<uint32_t> infinite_lights;
  LightGroups light_groups;
  std::unique_ptr<const emitters::LightSampler> light_sampler;
  std::vector<std::shared_ptr<const media::Medium>> media;
  int32_t camera_medium = vacuum;
  GlowTable glow;
  Camera camera;
  Filter filter = Filter::box(0.5f);
  Film::Settings film;
  uint64_t fingerprint = 0;  ///< of the scene files and meshes; images count by their names

  /// The light a primitive emits, or null.
  const emitters::Light* emitter(uint32_t geometry, uint32_t primitive) const {
    const uint32_t index = emitter_index(geometry, primitive);
    return index == trace::no_id ? nullptr : lights[index].get();
  }
  uint32_t emitter_index(uint32_t geometry, uint32_t primitive) const {
    const uint32_t first = bindings[geometry].first_light;
    return first == trace::no_id ? trace::no_id : light_table[first + primitive];
  }
  bool has_media() const { return !media.empty(); }
  /// The light that a medium's emission belongs to, along a way through it that begins at p; no_id: none, rays find it
  /// by chance.
  uint32_t glow_light(int32_t medium, const V3f& p) const {
    return medium == vacuum ? trace::no_id : glow.light(medium, p);
  }
  bool is_glow(uint32_t light) const { return light != trace::no_id && light >= glow.first_light(); }
  /// Writes lane `lane` of `points` from a surface point, whose footprint has the sides dx and dy.
  static void set_point(const geom::SurfacePoint& s, const V3f& dx, const V3f& dy, float time, uint64_t key,
                        pattern::ShadingPoints* points, int lane);
  /// The same with a footprint that is where a cone of width `width` around direction d meets the surface.
  static void set_point(const geom::SurfacePoint& s, const V3f& d, float width, float time, uint64_t key,
                        pattern::ShadingPoints* points, int lane);

  void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v, const float* time,
               float* alpha) const override;
  void colored_opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                       const float* time, RGB* alpha) const override;

 private:
  template <class T>
  void evaluate(const pattern::Texture<T>& texture, uint32_t geometry, int n, const uint32_t* primitive, const float* u,
                const float* v, const float* time, T* out) const;
};

}  // namespace dapple::scene
