// SPDX-License-Identifier: Apache-2.0
// The part of DistributionIntegrator that finds, links and shades the grids that camera samples see.
#include "dapple/integrate/distribution_workspace.h"

namespace dapple::integrate {

using scene::GridId;
using shading::Bsdf;

namespace {
constexpr float most_refined = 4;  // times a shading point may be shorter than its pixel asks for

// Whatever happens, other threads must not wait for ever.
class PublishAtEnd {
 public:
  explicit PublishAtEnd(std::vector<Claimed>& claimed) : claimed_(claimed) {}
  ~PublishAtEnd() {
    for (const auto& [grid, parts] : claimed_) grid->publish(parts);
    claimed_.clear();
  }
  PublishAtEnd(const PublishAtEnd&) = delete;
  PublishAtEnd& operator=(const PublishAtEnd&) = delete;

 private:
  std::vector<Claimed>& claimed_;
};

// Large surfaces are shaded by whole tiles, however little of them the samples see. Much of a leaf is behind others.
ShadingGrid::Parts points_wanted(const ShadingGrid& grid, const scene::PatchTable::Neighbours& near, bool refined) {
  if (!PixelPoints::is_small(grid.id) && !refined) return (1u << grid.id.count()) - 1;
  ShadingGrid::Parts points = 1u << near.nearest;
  for (int c = 0; c < 4; ++c)
    if (near.weight[c] > 0) points |= 1u << near.index[c];
  return points;
}
}  // namespace

// Finds the grids of all samples in the store, and shades of them what nobody has shaded.
void DistributionIntegrator::fetch_grids(DistributionWorkspace& w) const {
  int n = 0, alone = 0, cut = 0;
  int cuts[DistributionWorkspace::capacity];
  std::fill_n(w.refined, w.camera.count, false);
  w.held.clear();
  for (int p = 0; p < w.camera.count; ++p)
    if (w.source[p] == Source::grid) w.order[n++] = p;
  find_grids(n, w);
  for (int i = 0; i < n; ++i) {
    const int p = w.order[i];
    if (restrict_points(p, w)) continue;
    // Another part of the group, or of a leaf, does not speak for it: the patch gets a point of its own.
    const GridId& id = w.point[p].grid;
    if (id.cluster_level == 0 && (settings_.pixel_points == 0 || id.u_level + id.v_level > 2)) {
      cuts[cut++] = p;
      continue;
    }
    GridId own;
    own.instance = id.instance, own.geometry = id.geometry, own.patch = w.point[p].patch, own.behind = id.behind, own.span = id.span;
    w.point[p] = {.grid = own, .patch = own.patch};
    w.near[p] = patches_.neighbours(w.point[p]);
    w.order[alone++] = p;
  }
  find_grids(alone, w);
  // Where something stands on a surface, finer points come between it and the sample.
  for (float finer = 2; cut > 0; finer *= 2) {
    n = 0;
    for (int i = 0; i < cut; ++i) {
      w.refined[cuts[i]] = true;
      if (finer <= most_refined && dice(cuts[i], finer, w))
        w.order[n++] = cuts[i];
      else
        w.source[cuts[i]] = Source::hit;
    }
    find_grids(n, w);
    cut = 0;
    for (int i = 0; i < n; ++i)
      if (!restrict_points(w.order[i], w)) cuts[cut++] = w.order[i];
  }
  shade_grids(w);
}

// Finds the shading points around a sample on its grid. False where none of them speaks for it.
bool DistributionIntegrator::restrict_points(int p, DistributionWorkspace& w) const {
  w.near[p] = patches_.neighbours(w.point[p]);
  return w.grid[p]->links.restrict_to(w.point[p], &w.near[p]);
}

// The grids of the first n samples in w.order, linked.
void DistributionIntegrator::find_grids(int n, DistributionWorkspace& w) const {
  std::fill_n(w.found, DistributionWorkspace::found_count, uint16_t(0));
  TileLinker::Scratch& linking = w.shading.linking;
  linking.job_count = 0;
  const Timer timer;
  {
    const PublishAtEnd publish(w.claimed);
    for (int i = 0; i < n; ++i) {
      const int p = w.order[i];
      const GridId& id = w.point[p].grid;
      // The samples of a batch see few grids.
      uint16_t& found = w.found[id.hash() % DistributionWorkspace::found_count];
      if (found > 0 && id == w.point[found - 1].grid) {
        w.grid[p] = w.grid[found - 1];
        continue;
      }
      found = uint16_t(p + 1);
      auto [grid, mine] = grids_.claim(id, shader_.materials().varies(id.geometry));
      ++w.caches[0].lookups;
      ++(mine ? w.caches[0].fills : w.caches[0].hits);
      if (mine) {
        w.claimed.push_back({grid.get(), ShadingGrid::linked});
        linking.jobs[linking.job_count++] = {id, &grid->links};
      }
      w.grid[p] = grid.get();
      w.held.push_back(std::move(grid));
    }
    shader_.link(false, w.shading);
  }
  w.caches[0].fill_seconds += timer.seconds();
  for (const int p : std::span(w.order, size_t(n))) w.grid[p]->wait(ShadingGrid::linked);
}

void DistributionIntegrator::shade_grids(DistributionWorkspace& w) const {
  const Timer timer;
  {
    const PublishAtEnd publish(w.claimed);
    for (int p = 0; p < w.camera.count; ++p)
      if (w.source[p] == Source::grid)
        if (const ShadingGrid::Parts mine = w.grid[p]->claim(points_wanted(*w.grid[p], w.near[p], w.refined[p]))) w.claimed.push_back({w.grid[p], mine});
    shade_claimed(w);
  }
  w.caches[0].fill_seconds += timer.seconds();
  for (int p = 0; p < w.camera.count; ++p)
    if (w.source[p] == Source::grid) w.grid[p]->wait(points_wanted(*w.grid[p], w.near[p], w.refined[p]));
}

// Gathers the points of the grids into full batches.
void DistributionIntegrator::shade_claimed(DistributionWorkspace& w) const {
  PointBatch& b = w.shading.level(sample_level);
  b.count = 0;
  for (const auto& [grid, parts] : w.claimed) {
    const GridId id = patches_seen(grid->id, w);
    const scene::PatchTable::Cell cell = patches_.cell(id, &w.shading.extents);
    for (int j = 0; j < id.height(); ++j)
      for (int i = 0; i < id.width(); ++i) {
        if (!(parts >> id.index(i, j) & 1) || patches_.is_outside(id, i, j)) continue;
        const int k = b.count;
        shader_.set_shading_point(id, i, j, cell, id.hash(), b, k);
        w.target[k] = {grid, id.index(i, j)};
        if (interpolator_) w.interpolation->point[k] = {id, i, j};
        if (++b.count == PointBatch::capacity) shade_batch(w);
      }
  }
  if (b.count > 0) shade_batch(w);
}

// A group with a patch to stand for it that the camera sees, on the side that was hit: those behind others are darker. A function of the
// name, and of where the camera is.
GridId DistributionIntegrator::patches_seen(const GridId& grid, DistributionWorkspace& w) const {
  GridId id = grid;
  if (id.cluster_level == 0) return id;
  for (uint32_t choice = 0; choice < scene::PatchTable::stand_ins; ++choice) {
    const geom::SurfacePoint s = patches_.choose_stand_in(&id, choice);
    const V3f to_eye = scene_.camera.to_eye(s.P);
    if ((dot(s.Ng, to_eye) < 0) != bool(id.behind)) continue;
    const V3f origin = offset_origin(s, to_eye);
    const float distance = length(to_eye);
    w.seen_ray.set(0, origin, to_eye * (1 / distance), distance, patches_.time(id), 0, patches_.cell(id).size);
    uint8_t hidden = 0;
    scene_.traced.occluded(w.seen_ray, 1, &hidden);
    if (!hidden) return id;
  }
  patches_.choose_stand_in(&id, 0);
  return id;
}

void DistributionIntegrator::shade_batch(DistributionWorkspace& w) const {
  PointBatch& b = w.shading.level(sample_level);
  shader_.prelight(b, HitShader::Arrival::view, w.shading);
  const HitShader::Place place{sample_level, {}, HitShader::Arrival::view};
  if (interpolator_) interpolator_->interpolate(place, *w.interpolation, w.shading);
  shader_.light_diffuse(place, w.shading);
  for (int k = 0; k < b.count; ++k) {
    ShadingGrid& grid = *w.target[k].grid;
    grid.diffuse[size_t(w.target[k].index)] = b.diffuse[k];
    std::copy_n(b.diffuse.at(k).parts, grid.groups, grid.parts(w.target[k].index));
    if (grid.bsdf) grid.bsdf[size_t(w.target[k].index)] = b.bsdf[k];
  }
  b.count = 0;
}

}  // namespace dapple::integrate
