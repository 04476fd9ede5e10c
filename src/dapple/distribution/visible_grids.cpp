// SPDX-License-Identifier: Apache-2.0
// The part of DistributionIntegrator that finds, links and shades the grids that camera samples see.
#include <atomic>
#include <bit>
#include <deque>

#include "dapple/base/parallel.h"
#include "dapple/distribution/distribution_workspace.h"

namespace dapple::distribution {

using gi::TileLinker;
using integrate::offset_origin;
using integrate::PointBatch;
using scene::GridId;
using shading::Bsdf;

namespace {
constexpr float most_refined = 4;  // times a shading point may be shorter than its pixel asks for
// A point is n times as fine as its pixel asks for if n of its lengths are less than this much of what that is: rates
// are powers of two, so that points are .7 to 1.4 times as long.
constexpr float finer_than = 1.2f;

// Whatever happens, other threads must not wait for ever.
class PublishLinks {
 public:
  ~PublishLinks() {
    for (ShadingGrid* grid : grids_) grid->publish(ShadingGrid::linked);
  }
  void add(ShadingGrid* grid) { grids_.push_back(grid); }

 private:
  std::vector<ShadingGrid*> grids_;
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

// Finds the points of all samples in the store, and claims what nobody has shaded.
void DistributionIntegrator::find_points(DistributionWorkspace& w) const {
  int n = 0, alone = 0, cut = 0;
  int cuts[DistributionWorkspace::capacity];
  for (int p = 0; p < w.camera.count; ++p)
    if (w.sample[p].source == Source::grid) w.order[n++] = p;
  find_grids(n, w);
  for (int i = 0; i < n; ++i) {
    CameraSample& s = w.sample[w.order[i]];
    if (restrict_points(s)) continue;
    // Another part of the group, or of a leaf, does not speak for it: the patch gets a point of its own.
    const GridId& id = s.point.grid;
    if (id.cluster_level == 0 && id.count() > 1 && (settings_.pixel_points == 0 || id.u_level + id.v_level > 2)) {
      cuts[cut++] = w.order[i];
      continue;
    }
    GridId own;
    own.instance = id.instance, own.geometry = id.geometry, own.patch = s.point.patch, own.behind = id.behind,
    own.span = id.span;
    s.point = {.grid = own, .patch = own.patch};
    w.order[alone++] = w.order[i];
  }
  find_grids(alone, w);
  for (int i = 0; i < alone; ++i) {
    CameraSample& s = w.sample[w.order[i]];
    if (restrict_points(s)) continue;
    // What stands on a wall may part rooms. Leaves cross each other by the thousand, as twigs do that are finer than
    // pixels.
    const bool is_wall = !shader_.materials().material(s.geometry).is_translucent() &&
                         patches_.cell(s.point.grid, &w.shading.extents).width() > s.width;
    if (!is_wall)
      s.near = patches_.neighbours(s.point);
    else
      cuts[cut++] = w.order[i];
  }
  // Where something stands on a surface, finer points come between it and the sample.
  for (float finer = 2; cut > 0; finer *= 2) {
    n = 0;
    for (int i = 0; i < cut; ++i) {
      CameraSample& s = w.sample[cuts[i]];
      s.refined = true;
      if (finer <= most_refined && dice(cuts[i], finer, w))
        w.order[n++] = cuts[i];
      else
        s.source = Source::hit;
    }
    find_grids(n, w);
    cut = 0;
    for (int i = 0; i < n; ++i)
      if (!restrict_points(w.sample[w.order[i]])) cuts[cut++] = w.order[i];
  }
  for (int p = 0; p < w.camera.count; ++p) {
    CameraSample& s = w.sample[p];
    if (s.source == Source::hit && shader_.materials().needs_tangents(s.geometry) &&
        !needs_tangents_where_seen(s.geometry))
      s.surface = scene_.traced.surface(w.hits, p, s.time);
    if (s.source != Source::grid) continue;
    s.wanted = points_wanted(*s.grid, s.near, s.refined);
    if (const ShadingGrid::Parts mine = s.grid->claim(s.wanted)) w.claimed.add(w.held[s.held], mine);
  }
}

// Finds the shading points around a sample on its grid. False where none of them speaks for it.
bool DistributionIntegrator::restrict_points(CameraSample& s) const {
  s.near = patches_.neighbours(s.point);
  return s.grid->links.restrict_to(s.point, &s.near);
}

// The grids of the first n samples in w.order, linked.
void DistributionIntegrator::find_grids(int n, DistributionWorkspace& w) const {
  if (n == 0) return;
  TileLinker::Scratch& linking = w.shading.linking;
  linking.job_count = 0;
  const size_t known = w.held.size();
  {
    PublishLinks links;
    for (int i = 0; i < n; ++i) {
      CameraSample& s = w.sample[w.order[i]];
      const GridId& id = s.point.grid;
      // The samples of a block see few grids.
      uint32_t& found = w.found[id.slot() % DistributionWorkspace::found_count];
      if (found == 0 || w.held[found - 1]->id != id) {
        auto [grid, mine] = grids_.claim(id, shader_.materials().varies(id.geometry));
        ++w.caches[0].lookups;
        ++(mine ? w.caches[0].fills : w.caches[0].hits);
        if (mine) {
          links.add(grid.get());
          linking.jobs[linking.job_count++] = {id, &grid->links};
        }
        w.held.push_back(std::move(grid));
        found = uint32_t(w.held.size());
      }
      s.held = found - 1;
      s.grid = w.held[s.held].get();
    }
    if (linking.job_count > 0) {
      const Timer timer;
      shader_.link(w.shading);
      w.caches[0].fill_seconds += timer.seconds();
    }
  }
  for (size_t g = known; g < w.held.size(); ++g) w.held[g]->wait(ShadingGrid::linked);
}

// Shades claimed points in full batches, until no more than so many are left.
void DistributionIntegrator::shade_claimed(int left, DistributionWorkspace& w) const {
  if (w.claimed.count() <= left) return;
  const Timer timer;
  PointBatch& b = w.shading.level(sample_level);
  try {
    for (size_t taken = 0; w.claimed.count() > left;) {
      b.count = 0;
      const auto claims = w.claimed.claims();
      for (taken = 0; taken < claims.size() && b.count + std::popcount(claims[taken].points) <= PointBatch::capacity;
           ++taken)
        add_points(*claims[taken].grid, w.claimed.take(taken), b, w);
      if (b.count > 0) shade_batch(w);
      w.claimed.publish(taken);
    }
  } catch (...) {
    w.claimed.publish(w.claimed.claims().size());
    throw;
  }
  w.caches[0].fill_seconds += timer.seconds();
}

// Shades what all threads have claimed, in batches that are full but not so large that some threads would have nothing
// to do.
void DistributionIntegrator::shade_all_claimed(std::span<const std::unique_ptr<Workspace>> workspaces) const {
  constexpr int at_a_time = 128;
  std::deque<ClaimedPoints> jobs;
  for (const auto& of : workspaces) {
    ClaimedPoints& claimed = static_cast<DistributionWorkspace&>(*of).claimed;
    while (claimed.count() > 0) claimed.give(at_a_time, &jobs.emplace_back());
  }
  std::atomic<size_t> next{0};
  parallel_for(workspaces.size(), [&](size_t i) {
    auto& w = static_cast<DistributionWorkspace&>(*workspaces[i]);
    for (size_t job; (job = next++) < jobs.size();) {
      jobs[job].give(at_a_time, &w.claimed);
      shade_claimed(0, w);
    }
  });
}

void DistributionIntegrator::add_points(ShadingGrid& grid, ShadingGrid::Parts points, PointBatch& b,
                                        DistributionWorkspace& w) const {
  const SeenGrid seen = seen_grid(grid, w);
  const GridId& id = seen.id;
  for (int j = 0; j < id.height(); ++j)
    for (int i = 0; i < id.width(); ++i) {
      if (!(points >> id.index(i, j) & 1) || patches_.is_outside(id, i, j)) continue;
      const int k = b.count++;
      set_grid_point(seen, i, j, b, k, w);
      w.target[k] = {&grid, id.index(i, j)};
      if (interpolator_)
        w.interpolation->point[k] = {id, i, j, finest_step(seen.cell, b.surface[k].P), grid.links.parts_tile()};
    }
}

DistributionIntegrator::SeenGrid DistributionIntegrator::seen_grid(const ShadingGrid& grid,
                                                                   DistributionWorkspace& w) const {
  const GridId id = patches_seen(grid.id, w);
  return {id, patches_.cell(id, &w.shading.extents), shared_work(id, w), grid.links};
}

void DistributionIntegrator::set_grid_point(const SeenGrid& grid, int i, int j, PointBatch& b, int k,
                                            DistributionWorkspace& w) const {
  const GridId& id = grid.id;
  if (shader_.direct().throws_edges() && patches_.has_lattice(id) && id.count() > 1)
    shader_.set_seen_cell(id, i, j, grid.cell, id.hash(), grid.links, &w.shading.extents, b, k);
  else
    shader_.set_shading_point(id, i, j, grid.cell, id.hash(), &w.shading.extents, b, k);
  b.share[k] *= grid.shares.rays, b.crowd[k] = grid.shares.diffuse;
}

// Points that are finer than their pixels ask for share the hemispheres of those around them.
int DistributionIntegrator::finest_step(const scene::PatchTable::Cell& cell, const V3f& P) const {
  const float width = scene_.camera.pixel_width(P) * std::sqrt(settings_.shading_rate);
  const float length = scene::PatchTable::seen_length(cell, normalize(scene_.camera.to_eye(P)));
  int step = 1;
  for (float refined = 2; refined <= most_refined && length * refined <= finer_than * width; refined *= 2) ++step;
  return step;
}

// A group with a patch to stand for it that the camera sees, on the side that was hit: those behind others are darker.
// A function of the name, and of where the camera is.
GridId DistributionIntegrator::patches_seen(const GridId& grid, DistributionWorkspace& w) const {
  GridId id = grid;
  if (id.cluster_level == 0) return id;
  constexpr uint32_t most_choices = 8;
  for (uint32_t choice = 0; choice < most_choices; ++choice) {
    const geom::SurfacePoint s = patches_.choose_stand_in(&id, choice);
    const V3f to_eye = scene_.camera.to_eye(s.P);
    if ((dot(s.Ng, to_eye) < 0) != bool(id.behind)) continue;
    const V3f origin = offset_origin(s, to_eye);
    const float distance = length(to_eye);
    w.seen_ray.set(0, origin, to_eye * (1 / distance), distance, patches_.time(id), 0, patches_.cell(id).size);
    RGB passed;
    scene_.traced.transmitted(w.seen_ray, 1, &passed);
    if (!passed.is_black()) return id;
  }
  patches_.choose_stand_in(&id, 0);
  return id;
}

// What points of small patches share of the work of one; the last few rays are each point's own. Where hemispheres
// serve many points, diffuse rays are so many as those of one hemisphere, which a leaf cannot share.
DistributionIntegrator::Shares DistributionIntegrator::shared_work(const GridId& grid, DistributionWorkspace& w) const {
  constexpr int least_rays = 4, points_of_hemisphere = 16;
  const int most = std::max(settings_.shading.shadow_rays.at(0) / least_rays, 1),
            most_diffuse = std::max(settings_.shading.diffuse_rays.at(0) / least_rays, 1);
  if (!PixelPoints::is_small(grid))
    return {1, interpolator_ ? std::min(IrradianceInterpolator::unserved_share, most_diffuse) : 1};
  const int alone = interpolator_ ? std::min(points_of_hemisphere, most_diffuse) : 1;
  const int crowd = most > 1 || most_diffuse > alone ? points_in_pixel(grid, w) : 1;
  const int rays = std::min(crowd, most), diffuse = std::min(crowd * alone, most_diffuse);
  return {rays, std::max(diffuse / rays, 1)};
}

// A pixel that sees many small patches shows the mean of some. So many as rays through the footprint of a pixel around
// this one meet: a function of the name, as in patches_seen().
int DistributionIntegrator::points_in_pixel(const GridId& grid, DistributionWorkspace& w) const {
  constexpr int most = int(PixelPoints::first_samples);
  const int rays =
      std::min({settings_.pixel_points > 0 ? settings_.pixel_points : most, settings_.pixel_samples, most});
  const float time = patches_.time(grid);
  patches_.shading_point(grid, grid.width() / 2, grid.height() / 2, scene_.camera.position(), &w.seen_hits, 0);
  const V3f P = scene_.traced.surface(w.seen_hits, 0, time, false).P, to_eye = scene_.camera.to_eye(P);
  const float distance = length(to_eye), width = scene_.camera.pixel_width(P);
  if (!(distance > 0) || !(width > 0)) return 1;
  const Frame frame(to_eye * (1 / distance));
  const uint32_t seed = uint32_t(grid.hash());
  const float reach =
      std::min(distance, length(scene_.traced.bounds().size()));  // an eye that is far away would cost digits
  for (int i = 0; i < rays; ++i) {
    const V2f at = sample_2d(seed, uint32_t(i), 0);
    const V3f aside = (frame.s * (at.x - 0.5f) + frame.t * (at.y - 0.5f)) * width, way = normalize(to_eye - aside);
    w.seen_ray.set(i, P + aside + way * reach, -way, infinity, time, trace::ray_key(seed, uint32_t(i)), width, 0);
  }
  scene_.traced.intersect(w.seen_ray, rays, &w.seen_hits);
  GridId seen[most];
  int count = 0;
  for (int i = 0; i < rays; ++i) {
    if (w.seen_hits.geometry[i] == trace::no_id) continue;
    const geom::SurfacePoint s = scene_.traced.surface_without_tangents(w.seen_ray, w.seen_hits, i);
    const auto hit = patches_.patch_hit(w.seen_hits, i, w.seen_ray.direction(i), time, s, &w.shading.extents);
    scene::GridPoint point;
    if (!patches_.dice(hit, width * std::sqrt(settings_.shading_rate), &point)) continue;
    if (PixelPoints::is_small(point.grid) && std::find(seen, seen + count, point.grid) == seen + count)
      seen[count++] = point.grid;
  }
  return std::max(count, 1);
}

void DistributionIntegrator::shade_batch(DistributionWorkspace& w) const {
  PointBatch& b = w.shading.level(sample_level);
  const HitShader::Place place{sample_level, {}, HitShader::Arrival::view};
  shader_.prelight(place, w.shading);
  if (interpolator_) interpolator_->interpolate(place, *w.interpolation, w.shading);
  shader_.light_diffuse(place, w.shading);
  for (int k = 0; k < b.count; ++k) {
    ShadingGrid& grid = *w.target[k].grid;
    grid.diffuse[size_t(w.target[k].index)] = b.diffuse[k];
    std::copy_n(b.diffuse.at(k).parts, grid.groups, grid.parts(w.target[k].index));
    if (grid.bsdf) grid.bsdf[size_t(w.target[k].index)] = b.bsdf[k];
  }
}

}  // namespace dapple::distribution
