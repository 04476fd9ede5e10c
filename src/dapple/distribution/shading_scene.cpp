// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/shading_scene.h"

#include <bit>
#include <utility>

#include "dapple/distribution/cache_numbers.h"
#include "dapple/trace/bulk_bounds.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RaySet;
using integrate::RayTracer;
using light::SurfaceMedia;

namespace {

float common_cell(const scene::Scene& scene) {
  const Box3f box = trace::bulk_bounds(scene.traced);
  if (box.isEmpty()) return infinity;
  const V3f size = box.size();
  const float area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x) / CacheNumbers::common_cells;
  return area > 0 ? std::exp2(std::floor(std::log2(area))) : infinity;
}

}  // namespace

ShadingScene::ShadingScene(const scene::Scene& of, const ShadingSettings& with, const scene::PatchTable* patches_of)
    : scene(of),
      patches(patches_of),
      settings(with),
      materials(of, with.caustics),
      tracer(of, materials, true, with.visibility),
      direct(of, tracer, with.shadow_rays, with.learned_lights),
      surface_media(of),
      common_area(common_cell(of)),
      linker_(of, materials, patches_of) {}

void ShadingScene::trace(RaySet& r, ShadingWorkspace& w) const {
  if (scene.has_media() && !r.flights) r.flights = std::make_unique<RayTracer::Flights>();
  const Timer timer;
  tracer.nearest(r.rays, r.count, r.medium, &r.hits, r.distance, w.passed, w.tracing, r.flights.get(), r.sheets);
  w.stages.tracing_seconds += timer.seconds();
  w.stages += std::exchange(w.tracing.stages, {});
  for (int i = 0; i < r.count; ++i) r.glow[i] = r.flights ? r.weight[i] * r.flights->emitted[i] : RGB();
  r.lit.clear();
  if (r.flights)
    for (const auto& lit : r.flights->lit) r.lit.push_back({lit.ray, lit.light, r.weight[lit.ray] * lit.radiance});
  if (!tracer.weakens()) return;
  for (int i = 0; i < r.count; ++i) r.weight[i] *= w.passed[i];
}

void ShadingScene::link(ShadingWorkspace& w) const {
  const Timer timer;
  w.rays.link += linker_.link(w.linking);
  w.stages.tracing_seconds += timer.seconds();
}

void ShadingScene::find_media(PointBatch& b, ShadingWorkspace& w) const {
  if (!surface_media.vary()) return;
  if (!w.surface_media) w.surface_media = std::make_unique<SurfaceMedia::Scratch>();
  const Timer timer;
  surface_media.find(b, *w.surface_media);
  w.stages.tracing_seconds += timer.seconds();
}

// Cells are those nearest to as wide as asked for, in both directions (PatchTable::dice), but for patches that are
// smaller.
ReadCell ShadingScene::read_cell(const scene::GridId& tile, scene::PatchTable::Extents* memory) const {
  const scene::PatchTable::Cell cell = patches->cell(tile, memory);
  constexpr float half_step = ReadCell::half_step;
  ReadCell r{cell.area(), cell.size / half_step, infinity};
  if (tile.cluster_level > 0 || cell.s == V3f(0, 0, 0)) {
    r.most_width = cell.size * half_step;
    return r;
  }
  if (tile.u_level > 0) r.most_width = length(cell.s) * half_step;
  if (tile.v_level > 0) r.most_width = std::min(r.most_width, length(cell.t) * half_step);
  r.most_width = std::max(r.most_width, r.least_width * half_step);
  if (patches->is_half(tile) && tile.u_level + tile.v_level == 0) r.area *= 0.5f;
  return r;
}

float ShadingScene::most_readers(int depth) const {
  return CacheNumbers::widest_effort_at(depth) * float(settings.diffuse_rays.at(depth)) /
         CacheNumbers::filled_rays_at(depth);
}

int ShadingScene::cell_effort(const ReaderMap::Reader& at, int depth, const ReadCell& cell) const {
  const float effort =
      readers->readers(at, depth, cell) * CacheNumbers::filled_rays_at(depth) / float(settings.diffuse_rays.at(depth));
  return effort < 1 ? 0 : int(std::bit_floor(uint32_t(std::min(effort, CacheNumbers::most_effort))));
}

void set_flight(const RayTracer::Flights& flights, int f, const trace::RayBatch& rays, int share, PointBatch& b,
                int k) {
  const int r = flights.ray[f];
  b.parent[k] = r;
  b.surface[k] = {};
  b.surface[k].P = flights.P[f];
  b.geometry[k] = trace::no_id;
  b.wo[k] = -rays.direction(r);
  b.set_one_time(k, rays.time[r]);
  b.width[k] = rays.width[r] + rays.spread[r] * length(flights.P[f] - rays.origin(r));
  b.spread[k] = rays.spread[r];
  b.medium[k] = flights.medium[f];
  b.wavelength[k] = 0;
  b.set_key(k, random_of(rays.key[r], Purpose::flights));
  b.share[k] = share;
  b.crowd[k] = b.effort[k] = 1;
  b.throughput[k] = 1;
}

}  // namespace dapple::distribution
