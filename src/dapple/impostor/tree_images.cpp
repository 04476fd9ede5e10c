// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/tree_images.h"

#include <algorithm>

#include "dapple/base/parallel.h"

namespace dapple::impostor {

using depthimage::ObjectImages;
using depthimage::SplatObject;

std::vector<uint8_t> placed_objects(const scene::Scene& scene) {
  std::vector<uint8_t> placed;
  for (uint32_t i = 0; i < scene.traced.single_count(); ++i) {
    if (scene.traced.is_animated(i)) continue;
    const uint32_t object = scene.traced.object_of(i);
    if (object >= placed.size()) placed.resize(object + 1, 0);
    placed[object] = 1;
  }
  return placed;
}

TreeImages make_tree_images(const scene::Scene& scene, const BakeSettings& settings,
                            const std::vector<ObjectImages>& baked) {
  const ObjectBaker baker(scene, settings);
  const std::vector<uint8_t> placed = placed_objects(scene);
  TreeImages out;
  out.objects.resize(placed.size());
  for (uint32_t object = 0; object < placed.size(); ++object) {
    if (!placed[object]) continue;
    if (const std::string why = baker.refusal(object); !why.empty()) {
      out.refused.push_back("object " + std::to_string(object) + " has " + why);
      continue;
    }
    const uint64_t key = baked.empty() ? 0 : baker.key(object);
    const auto known = std::find_if(baked.begin(), baked.end(), [&](const auto& images) { return images.key == key; });
    if (known != baked.end()) {
      out.objects[object] = std::make_shared<const SplatObject>(*known);
      ++out.from_file;
      continue;
    }
    out.objects[object] = std::make_shared<const SplatObject>(baker.bake(object, "object " + std::to_string(object)));
    ++out.baked;
  }
  return out;
}

size_t TreeImages::bytes() const {
  size_t sum = 0;
  for (const auto& object : objects)
    if (object) sum += object->bytes();
  return sum;
}

}  // namespace dapple::impostor
