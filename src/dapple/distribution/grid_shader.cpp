// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/grid_shader.h"

#include <bit>

#include "dapple/distribution/camera_samples.h"
#include "dapple/distribution/grid_numbers.h"
#include "dapple/distribution/interpolation_numbers.h"

namespace dapple::distribution {

using integrate::offset_origin;
using integrate::PointBatch;
using scene::GridId;

using Numbers = GridNumbers;

void GridShader::shade(int left, ClaimedPoints& claimed, Scratch& scratch, ShadingWorkspace& w) const {
  if (claimed.count() <= left) return;
  const Timer timer;
  PointBatch& b = w.level(sample_level);
  try {
    for (size_t taken = 0; claimed.count() > left;) {
      b.count = 0;
      const auto claims = claimed.claims();
      for (taken = 0; taken < claims.size() && b.count + std::popcount(claims[taken].points) <= PointBatch::capacity;
           ++taken)
        add_points(*claims[taken].grid, claimed.take(taken), b, scratch, w);
      if (b.count > 0) shade_batch(scratch, w);
      claimed.publish(taken);
    }
  } catch (...) {
    claimed.publish(claimed.claims().size());
    throw;
  }
  scratch.seconds += timer.seconds();
}

void GridShader::add_points(ShadingGrid& grid, ShadingGrid::Parts points, PointBatch& b, Scratch& scratch,
                            ShadingWorkspace& w) const {
  const SeenGrid seen = seen_grid(grid, scratch, w);
  const GridId& id = seen.id;
  for (int j = 0; j < id.height(); ++j)
    for (int i = 0; i < id.width(); ++i) {
      if (!(points >> id.index(i, j) & 1) || shading_.patches->is_outside(id, i, j)) continue;
      const int k = b.count++;
      set_point(seen, i, j, b, k, w);
      scratch.target[k] = {&grid, id.index(i, j)};
      if (interpolator_)
        scratch.interpolation->point[k] = {id, i, j, finest_step(seen.cell, b.surface[k].P), grid.links.parts_tile()};
    }
}

GridShader::SeenGrid GridShader::seen_grid(const ShadingGrid& grid, Scratch& scratch, ShadingWorkspace& w) const {
  const GridId id = patches_seen(grid.id, scratch);
  return {id, shading_.patches->cell(id, &w.extents), shared_work(id, scratch, w), grid.links};
}

void GridShader::set_point(const SeenGrid& grid, int i, int j, PointBatch& b, int k, ShadingWorkspace& w) const {
  const GridId& id = grid.id;
  if (shading_.direct.throws_edges() && shading_.patches->has_lattice(id) && id.count() > 1)
    placer_.place_seen_cell(id, i, j, grid.cell, id.hash(), grid.links, &w.extents, b, k);
  else
    placer_.place(id, i, j, grid.cell, id.hash(), &w.extents, b, k);
  b.share[k] *= grid.shares.rays, b.crowd[k] = grid.shares.diffuse;
}

// Points that are finer than their pixels ask for share the hemispheres of those around them.
int GridShader::finest_step(const scene::PatchTable::Cell& cell, const V3f& P) const {
  const float width = shading_.scene.camera.pixel_width(P) * std::sqrt(settings_.shading_rate);
  const float length = scene::PatchTable::seen_length(cell, normalize(shading_.scene.camera.to_eye(P)));
  int step = 1;
  for (float refined = 2; refined <= Numbers::most_refined && length * refined <= Numbers::finer_than * width;
       refined *= 2)
    ++step;
  return step;
}

// A group with a patch to stand for it that the camera sees, on the side that was hit: those behind others are darker.
// A function of the name, and of where the camera is.
GridId GridShader::patches_seen(const GridId& grid, Scratch& scratch) const {
  GridId id = grid;
  if (id.cluster_level == 0) return id;
  constexpr uint32_t most_choices = 8;
  for (uint32_t choice = 0; choice < most_choices; ++choice) {
    const geom::SurfacePoint s = shading_.patches->choose_stand_in(&id, choice);
    const V3f to_eye = shading_.scene.camera.to_eye(s.P);
    if ((dot(s.Ng, to_eye) < 0) != bool(id.behind)) continue;
    const V3f origin = offset_origin(s, to_eye);
    const float distance = length(to_eye);
    scratch.seen_ray.set(0, origin, to_eye * (1 / distance), distance, shading_.patches->time(id), 0,
                         shading_.patches->cell(id).size);
    RGB passed;
    shading_.scene.traced.transmitted(scratch.seen_ray, 1, &passed);
    if (!passed.is_black()) return id;
  }
  shading_.patches->choose_stand_in(&id, 0);
  return id;
}

// What points of small patches share of the work of one; the last few rays are each point's own. Where hemispheres
// serve many points, diffuse rays are so many as those of one hemisphere, which a leaf cannot share.
GridShader::Shares GridShader::shared_work(const GridId& grid, Scratch& scratch, ShadingWorkspace& w) const {
  const int most = std::max(settings_.shading.shadow_rays.at(0) / Numbers::least_rays, 1),
            most_diffuse = std::max(settings_.shading.diffuse_rays.at(0) / Numbers::least_rays, 1);
  if (!PixelPoints::is_small(grid))
    return {1, interpolator_ ? std::min(InterpolationNumbers::unserved_share, most_diffuse) : 1};
  const int alone = interpolator_ ? std::min(Numbers::points_of_hemisphere, most_diffuse) : 1;
  const int crowd = most > 1 || most_diffuse > alone ? points_in_pixel(grid, scratch, w) : 1;
  const int rays = std::min(crowd, most), diffuse = std::min(crowd * alone, most_diffuse);
  return {rays, std::max(diffuse / rays, 1)};
}

// A pixel that sees many small patches shows the mean of some. So many as rays through the footprint of a pixel around
// this one meet: a function of the name, as in patches_seen().
int GridShader::points_in_pixel(const GridId& grid, Scratch& scratch, ShadingWorkspace& w) const {
  constexpr int most = int(Numbers::first_samples);
  const int rays =
      std::min({settings_.pixel_points > 0 ? settings_.pixel_points : most, settings_.pixel_samples, most});
  const float time = shading_.patches->time(grid);
  shading_.patches->shading_point(grid, grid.width() / 2, grid.height() / 2, &scratch.seen_hits, 0);
  const V3f P = shading_.scene.traced.surface(scratch.seen_hits, 0, time, false).P,
            to_eye = shading_.scene.camera.to_eye(P);
  const float distance = length(to_eye), width = shading_.scene.camera.pixel_width(P);
  if (!(distance > 0) || !(width > 0)) return 1;
  const Frame frame(to_eye * (1 / distance));
  const uint32_t seed = uint32_t(grid.hash());
  const float reach =
      std::min(distance, length(shading_.scene.traced.bounds().size()));  // an eye that is far away would cost digits
  for (int i = 0; i < rays; ++i) {
    const V2f at = sample_2d(seed, uint32_t(i), 0);
    const V3f aside = (frame.s * (at.x - 0.5f) + frame.t * (at.y - 0.5f)) * width, way = normalize(to_eye - aside);
    scratch.seen_ray.set(i, P + aside + way * reach, -way, infinity, time, trace::ray_key(seed, uint32_t(i)), width, 0);
  }
  shading_.scene.traced.intersect(scratch.seen_ray, rays, &scratch.seen_hits);
  GridId seen[most];
  int count = 0;
  for (int i = 0; i < rays; ++i) {
    if (scratch.seen_hits.geometry[i] == trace::no_id) continue;
    const geom::SurfacePoint s = shading_.scene.traced.surface_without_tangents(scratch.seen_ray, scratch.seen_hits, i);
    const auto hit =
        shading_.patches->patch_hit(scratch.seen_hits, i, scratch.seen_ray.direction(i), time, s, &w.extents);
    scene::GridPoint point;
    if (!shading_.patches->dice(hit, width * std::sqrt(settings_.shading_rate), &point)) continue;
    if (PixelPoints::is_small(point.grid) && std::find(seen, seen + count, point.grid) == seen + count)
      seen[count++] = point.grid;
  }
  return std::max(count, 1);
}

void GridShader::shade_batch(Scratch& scratch, ShadingWorkspace& w) const {
  PointBatch& b = w.level(sample_level);
  const Place place{sample_level, {}, Arrival::view};
  shader_.prelight(place, w);
  if (interpolator_) interpolator_->interpolate(place, *scratch.interpolation, w);
  shader_.light_diffuse(place, w);
  for (int k = 0; k < b.count; ++k) {
    ShadingGrid& grid = *scratch.target[k].grid;
    grid.diffuse[size_t(scratch.target[k].index)] = b.diffuse[k];
    std::copy_n(b.diffuse.at(k).parts, grid.groups, grid.parts(scratch.target[k].index));
    if (grid.bsdf) grid.bsdf[size_t(scratch.target[k].index)] = b.bsdf[k];
  }
}

}  // namespace dapple::distribution
