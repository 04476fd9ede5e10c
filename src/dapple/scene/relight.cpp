// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/relight.h"

#include "dapple/emitters/distant_light.h"

namespace dapple::scene {

void light_by_sun_only(Scene* scene, const V3f& to_sun, RGB irradiance) {
  scene->light_sampler.reset();
  scene->lights.clear();
  scene->light_table.clear();
  for (GeometryBinding& b : scene->bindings) b.first_light = trace::no_id;
  scene->lights.push_back(std::make_unique<emitters::DistantLight>(to_sun, irradiance));
  scene->infinite_lights = {0};
  scene->light_sampler =
      std::make_unique<emitters::LightSampler>(std::vector<const emitters::Light*>{scene->lights[0].get()}, 1.0f);
}

}  // namespace dapple::scene
