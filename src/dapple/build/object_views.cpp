// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/object_views.h"

#include <Imath/ImathBoxAlgo.h>

#include "dapple/build/nearest_placements.h"

namespace dapple::build {

using geom::DicingView;
using Imath::Box3d;
using scenefile::ShapeEntity;

namespace {

Box3d bounds_of(const scenefile::SceneDescription& d, const ShapeEntity& e) {
  const Box3d own = estimated_bounds(d, e);
  Box3d box = Imath::transform(own, e.transform.start.matrix().transposed());
  if (e.transform.is_animated()) box.extendBy(Imath::transform(own, e.transform.end.matrix().transposed()));
  return box;
}

}  // namespace

std::vector<std::shared_ptr<const DicingView>> object_views(const BuildContext& context,
                                                            const std::shared_ptr<const CameraView>& camera,
                                                            const std::function<bool(const ShapeEntity&)>& wanted,
                                                            MotionEnds ends) {
  const auto& d = context.description;
  std::vector<uint8_t> has_wanted(d.objects.size());
  std::vector<Box3d> bounds(d.objects.size());
  for (size_t i = 0; i < d.objects.size(); ++i)
    for (const ShapeEntity& e : d.objects[i].shapes)
      if (wanted(e)) has_wanted[i] = 1, bounds[i].extendBy(bounds_of(d, e));
  std::vector<std::vector<Transform>> placements = nearest_placements(context, has_wanted, *camera, bounds);
  for (const auto& instance : d.instances) {
    const auto object = size_t(instance.object);
    if (!has_wanted[object] || !instance.is_shown()) continue;
    const scenefile::TransformPair t = context.origins.of_instance(instance);
    placements[object].push_back(t.start);
    if (ends == MotionEnds::both && t.is_animated()) placements[object].push_back(t.end);
  }
  std::vector<std::shared_ptr<const DicingView>> views;
  for (size_t i = 0; i < placements.size(); ++i) {
    const V3d& origin = context.origins.objects[i];
    const Box3f box = bounds[i].isEmpty() ? Box3f() : Box3f(V3f(bounds[i].min - origin), V3f(bounds[i].max - origin));
    views.push_back(placements[i].empty() ? nullptr : std::make_shared<InstancesView>(camera, placements[i], box));
  }
  return views;
}

}  // namespace dapple::build
