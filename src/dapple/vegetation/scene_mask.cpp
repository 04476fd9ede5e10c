// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/scene_mask.h"

#include <cmath>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/scene/patch_table.h"

namespace dapple::vegetation {

using integrate::RayTracer;

forest::CanopyMask mask_of_scene(const scene::Scene& scene, const SceneMaskView& v, bool periodic) {
  forest::CanopyMask mask{forest::Raster(v.width, v.height, scene.traced.has_colored_opacity() ? 3 : 1), v.pitch,
                          periodic};
  const Box3f bounds = scene.traced.bounds();
  const double bottom = v.ground + v.clearance, top = bounds.isEmpty() ? bottom : double(bounds.max.z) + 1e-3;
  const int side = int(std::ceil(std::sqrt(double(v.samples))));
  const V3d& d = v.direction;
  const double back = (bottom - v.plane) / d.z;
  const integrate::MaterialTable materials(scene);
  const RayTracer tracer(scene, materials, false);
  const std::vector<int32_t> nowhere(RayTracer::capacity, scene::vacuum);
  parallel_for(size_t(v.height), [&](size_t row) {
    trace::RayBatch rays;
    RGB share[trace::RayBatch::capacity];
    int pixel[trace::RayBatch::capacity];
    std::vector<RGB> passed(size_t(v.width));
    int n = 0;
    const auto scratch = std::make_unique<RayTracer::Scratch>();
    const auto flush = [&] {
      tracer.visible(rays, n, nowhere.data(), share, *scratch);
      for (int i = 0; i < n; ++i) passed[size_t(pixel[i])] += share[i];
      n = 0;
    };
    for (int x = 0; x < v.width; ++x)
      for (int s = 0; s < side * side; ++s) {
        KeyedRng rng(hash(uint64_t(x), uint64_t(row), uint64_t(s), uint64_t{0x6d61736b}));
        const double i = x + (s % side + double(rng.next())) / side,
                     j = double(row) + (s / side + double(rng.next())) / side;
        V3d p(v.centre_x + (i - 0.5 * v.width) * v.pitch + back * d.x,
              v.centre_y + (0.5 * v.height - j) * v.pitch + back * d.y, bottom);
        if (v.relief) p.z += double(v.relief(p.x, p.y));
        if (!(p.z < top)) {  // nothing stands above it, or there is no ground
          passed[size_t(x)] += RGB(1);
          continue;
        }
        const float reach = float((top - p.z) / d.z);
        rays.set(n, V3f(float(p.x), float(p.y), float(p.z)), V3f(float(d.x), float(d.y), float(d.z)), reach,
                 scene::PatchTable::dicing_time, uint32_t(rng.next_bits()));
        pixel[n++] = x;
        if (n == trace::RayBatch::capacity) flush();
      }
    if (n > 0) flush();
    for (int c = 0; c < mask.transmittance.channels; ++c)
      for (int x = 0; x < v.width; ++x)
        mask.transmittance.row(c, int(row))[x] = passed[size_t(x)][c] / float(side * side);
  });
  return mask;
}

}  // namespace dapple::vegetation
