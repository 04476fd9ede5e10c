// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/depthimage/splat_object.h"
#include "dapple/impostor/object_baker.h"

namespace dapple::impostor {

/// The images of a scene's objects, by object: null where rays show it.
struct TreeImages {
  std::vector<std::shared_ptr<const depthimage::SplatObject>> objects;
  size_t from_file = 0, baked = 0;
  std::vector<std::string> refused;  ///< "object 3 has curves", of objects that are placed
  size_t bytes() const;
};

/// Whether something still places an object.
std::vector<uint8_t> placed_objects(const scene::Scene& scene);

/// Takes the images from `baked` where their keys are those of the scene's objects, and makes the others.
TreeImages make_tree_images(const scene::Scene& scene, const BakeSettings& settings,
                            const std::vector<depthimage::ObjectImages>& baked);

}  // namespace dapple::impostor
