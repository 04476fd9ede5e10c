// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dapple/depthimage/layered_image.h"
#include "dapple/scene/scene.h"

namespace dapple::impostor {

struct BakeSettings {
  int resolution = 512;  ///< texels a side of the finest level, a power of two
  int views = 6;         ///< depthimage::view_directions()
  int layers = 0;        ///< kept on each line; 0: all
};

/// Makes images of object definitions: A-buffers of what their facets show, with the materials' diffuse reflectance and
/// transmittance where they are. Cut-outs lose samples at random, by their opacity there.
class ObjectBaker {
 public:
  static constexpr size_t most_facets = size_t(1) << 25;

  /// std::invalid_argument for settings that are out of range. The scene must outlive it.
  ObjectBaker(const scene::Scene& scene, const BakeSettings& settings);

  /// Why an object cannot be shown by images: what of it they do not hold. Empty if it can.
  std::string refusal(uint32_t object) const;
  /// Of all that images of an object depend on: facets, opacity, mean optics, settings, version.
  uint64_t key(uint32_t object) const;
  /// Of an object that is not refused. The levels and views are made in parallel.
  depthimage::ObjectImages bake(uint32_t object, const std::string& name) const;

  const BakeSettings& settings() const { return settings_; }

 private:
  struct Facets;
  struct Job;
  Facets facets_of(uint32_t object) const;
  void make_view(const Facets& facets, const depthimage::ObjectImages& images, Job* job) const;
  void cut_out(const Facets& facets, Job* job) const;
  void colour(const Facets& facets, Job* job) const;
  static void encode_colours(std::vector<Job>* jobs, depthimage::ObjectImages* images);

  const scene::Scene& scene_;
  const BakeSettings settings_;
};

}  // namespace dapple::impostor
