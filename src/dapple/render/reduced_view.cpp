// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/reduced_view.h"

#include <algorithm>

namespace dapple::render {

namespace {

int reduced(int pixels, int reduction) {
  return std::max((pixels + reduction - 1) / reduction, 1);
}

scene::Film::Settings reduced(scene::Film::Settings s, int reduction, int light_groups) {
  s.resolution = V2i(reduced(s.resolution.x, reduction), reduced(s.resolution.y, reduction));
  s.crop.min = V2i(s.crop.min.x / reduction, s.crop.min.y / reduction);
  s.crop.max = V2i(std::min(reduced(s.crop.max.x, reduction), s.resolution.x),
                   std::min(reduced(s.crop.max.y, reduction), s.resolution.y));
  s.light_groups = light_groups;
  return s;
}

}  // namespace

ReducedView::ReducedView(scene::Scene& scene, int reduction, int light_groups, Pixels pixels)
    : scene_(scene), camera_(scene.camera), film_(reduced(scene.film, reduction, light_groups)) {
  if (light_groups > 0) film_.set_gains(scene.light_groups.gains);
  scene::Camera::Settings s = camera_.settings();
  if (pixels == Pixels::sparse)
    s.stride = V2i(reduction, reduction);
  else
    s.resolution = film_.settings().resolution;
  scene.camera = scene::Camera(s);
}

ReducedView::~ReducedView() {
  scene_.camera = camera_;
}

}  // namespace dapple::render
