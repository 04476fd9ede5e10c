// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/emitters/light.h"
#include "dapple/scene/scene.h"

namespace dapple::emitters {
class LightMotion;
}

namespace dapple::build {

/// The shapes of a scene that shine, or would if their AreaLightSource was on: what their lights are made of, and can
/// be made of again where nothing has changed but what they emit.
class AreaLightShapes {
 public:
  struct Item {
    trace::Shape shape;  ///< in world space, at shutter open
    size_t entity = 0;   ///< place in SceneDescription::shapes
    uint32_t geometry;   ///< whose binding says which lights its primitives are
    pattern::FloatTexturePtr alpha{};
    std::shared_ptr<const emitters::LightMotion> motion{};  ///< null where it is still
    bool emits = true;
  };
  void add(Item item) { items_.push_back(std::move(item)); }

  struct Lights {
    std::vector<std::unique_ptr<const emitters::Light>> all;
    scene::LightGroups groups;
    std::vector<uint32_t> table;        ///< Scene::light_table
    std::vector<uint32_t> first_light;  ///< of each item, for its binding
  };
  /// InputError as make_area_lights(). In the order of the items, which is that of shapes in the file.
  Lights make(const BuildContext& context, const TextureLibrary& textures) const;
  /// To the scene, whose first lights they become: no other lights are in it.
  void set(Lights lights, scene::Scene* scene) const;
  /// Whether make() still gives what a new scene would have: shapes that have begun or ceased to shine may be other
  /// geometry.
  bool can_make_again(const scenefile::SceneDescription& description) const;

 private:
  void make(const Item& item, const scenefile::Entity& emission, const BuildContext& context,
            const TextureLibrary& textures, Lights* to) const;

  std::vector<Item> items_;
};

}  // namespace dapple::build
