// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/camera_paths.h"

namespace dapple::integrate {

namespace {
struct PathsAloneWorkspace final : Integrator::Workspace {
  std::unique_ptr<Integrator::Workspace> paths;
  PathSamples samples{0};
};
}  // namespace

std::unique_ptr<Integrator::Workspace> PathsAlone::make_workspace() const {
  auto w = std::make_unique<PathsAloneWorkspace>();
  w->paths = paths_.make_workspace();
  return w;
}

void PathsAlone::render(const TileWork& work, Workspace& workspace, scene::Film& film) const {
  auto& w = static_cast<PathsAloneWorkspace&>(workspace);
  PathSamples& s = w.samples;
  const PixelSets sets(work.pixel_samples, seed_);
  for (uint32_t i = 0; i < work.sample_count; ++i)
    CameraBatch::for_each_block(work.pixels, [&](const Box2i& box) {
      s.camera.generate(scene_, box, work.first_sample + i, sets);
      paths_.trace(others_, film.settings(), work.stop, s, *w.paths);
      for (int p = 0; p < s.camera.count; ++p)
        film.add(s.camera.pixel[p].x, s.camera.pixel[p].y, s.camera.film_weight[p], s.left[p] ? RGB() : s.L[p], {});
    });
}

}  // namespace dapple::integrate
