// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/grid_finder.h"

#include "dapple/distribution/grid_numbers.h"

namespace dapple::distribution {

using gi::TileLinker;
using scene::GridId;

namespace {

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

int GridFinder::list_grids(const CameraSamples& s, Scratch& scratch) const {
  int n = 0;
  for (int p = 0; p < s.count(); ++p)
    if (s.sample[p].source == Source::grid) scratch.order[n++] = p;
  return n;
}

void GridFinder::find_grids(CameraSamples& s, Scratch& scratch, ShadingWorkspace& w) const {
  find(list_grids(s, scratch), s, scratch, w);
}

void GridFinder::find_points(CameraSamples& samples, Scratch& scratch, ClaimedPoints& claimed,
                             ShadingWorkspace& w) const {
  int cuts[CameraSamples::capacity];
  const int cut = find_first(list_grids(samples, scratch), samples, scratch, cuts, w);
  refine(cuts, cut, samples, scratch, w);
  for (int p = 0; p < samples.count(); ++p) {
    CameraSample& sample = samples.sample[p];
    if (sample.source == Source::hit && shading_.materials.needs_tangents(sample.geometry) &&
        !hider_.needs_tangents(sample.geometry))
      sample.surface = shading_.scene.traced.surface(samples.hits, p, sample.time);
    if (sample.source != Source::grid) continue;
    sample.wanted = points_wanted(*sample.grid, sample.near, sample.refined);
    if (const ShadingGrid::Parts mine = sample.grid->claim(sample.wanted)) claimed.add(scratch.held[sample.held], mine);
  }
}

// Finds the grids that the pixels of the first n samples in scratch.order ask for. Writes those samples to `cuts` for
// which none of the points there speaks, and returns their number.
int GridFinder::find_first(int n, CameraSamples& samples, Scratch& scratch, int* cuts, ShadingWorkspace& w) const {
  int alone = 0, cut = 0;
  find(n, samples, scratch, w);
  for (int i = 0; i < n; ++i) {
    CameraSample& sample = samples.sample[scratch.order[i]];
    if (restrict_points(sample)) continue;
    // Another part of the group, or of a leaf, does not speak for it: the patch gets a point of its own.
    const GridId& id = sample.point.grid;
    if (id.cluster_level == 0 && id.count() > 1 && (settings_.pixel_points == 0 || id.u_level + id.v_level > 2)) {
      cuts[cut++] = scratch.order[i];
      continue;
    }
    GridId own;
    own.instance = id.instance, own.geometry = id.geometry, own.patch = sample.point.patch, own.behind = id.behind,
    own.span = id.span;
    sample.point = {.grid = own, .patch = own.patch};
    scratch.order[alone++] = scratch.order[i];
  }
  find(alone, samples, scratch, w);
  for (int i = 0; i < alone; ++i) {
    CameraSample& sample = samples.sample[scratch.order[i]];
    if (restrict_points(sample)) continue;
    // What stands on a wall may part rooms. Leaves cross each other by the thousand, as twigs do that are finer than
    // pixels.
    const bool is_wall = !shading_.materials.material(sample.geometry).is_translucent() &&
                         shading_.patches->cell(sample.point.grid, &w.extents).width() > sample.width;
    if (!is_wall)
      sample.near = shading_.patches->neighbours(sample.point);
    else
      cuts[cut++] = scratch.order[i];
  }
  return cut;
}

void GridFinder::refine(int* cuts, int cut, CameraSamples& samples, Scratch& scratch, ShadingWorkspace& w) const {
  // Where something stands on a surface, finer points come between it and the sample.
  for (float finer = 2; cut > 0; finer *= 2) {
    int n = 0;
    for (int i = 0; i < cut; ++i) {
      CameraSample& sample = samples.sample[cuts[i]];
      sample.refined = true;
      if (finer <= GridNumbers::most_refined && hider_.dice(cuts[i], finer, samples, w))
        scratch.order[n++] = cuts[i];
      else
        sample.source = Source::hit;
    }
    find(n, samples, scratch, w);
    cut = 0;
    for (int i = 0; i < n; ++i)
      if (!restrict_points(samples.sample[scratch.order[i]])) cuts[cut++] = scratch.order[i];
  }
}

// Finds the shading points around a sample on its grid. False where none of them speaks for it.
bool GridFinder::restrict_points(CameraSample& s) const {
  s.near = shading_.patches->neighbours(s.point);
  return s.grid->links.restrict_to(s.point, &s.near);
}

// The grids of the first n samples in scratch.order, linked.
void GridFinder::find(int n, CameraSamples& samples, Scratch& scratch, ShadingWorkspace& w) const {
  if (n == 0) return;
  TileLinker::Scratch& linking = w.linking;
  linking.job_count = 0;
  const size_t known = scratch.held.size();
  {
    PublishLinks links;
    for (int i = 0; i < n; ++i) {
      CameraSample& s = samples.sample[scratch.order[i]];
      const GridId& id = s.point.grid;
      // The samples of a block see few grids.
      uint32_t& found = scratch.found[id.slot() % Scratch::found_count];
      if (found == 0 || scratch.held[found - 1]->id != id) {
        auto [grid, mine] = store_.claim(id, shading_.materials.varies(id.geometry));
        ++scratch.counts.lookups;
        ++(mine ? scratch.counts.fills : scratch.counts.hits);
        if (mine) {
          links.add(grid.get());
          linking.jobs[linking.job_count++] = {id, &grid->links};
        }
        scratch.held.push_back(std::move(grid));
        found = uint32_t(scratch.held.size());
      }
      s.held = found - 1;
      s.grid = scratch.held[s.held].get();
    }
    if (linking.job_count > 0) {
      const Timer timer;
      shading_.link(w);
      scratch.counts.fill_seconds += timer.seconds();
    }
  }
  for (size_t g = known; g < scratch.held.size(); ++g) scratch.held[g]->wait(ShadingGrid::linked);
}

}  // namespace dapple::distribution
