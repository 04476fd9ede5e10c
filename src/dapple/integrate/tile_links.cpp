// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/tile_links.h"

#include <algorithm>

namespace dapple::integrate {

using scene::GridId;
using scene::PatchTable;
using trace::no_id;

namespace {

// In cells. Rays keep this far above the surface, and from the ends of their ways: of a room's floor, these are its walls.
constexpr float height = 0.03f;
constexpr float margin = 0.04f;

constexpr uint32_t all_cells = (1u << TileLinks::side * TileLinks::side) - 1;

}  // namespace

bool TileLinks::restrict_to(const scene::GridPoint& at, PatchTable::Neighbours* near) const {
  if (divided == 0 && cut == 0) return true;
  const GridId& id = at.grid;
  const int i0 = near->nearest % id.width(), j0 = near->nearest / id.width();
  if (near->nearest != at.cell() || is_divided(i0, j0)) return false;
  const auto open_u = [&](int i, int j, int to) { return i == to || !is_cut_in_u(std::min(i, to), j); };
  const auto open_v = [&](int i, int j, int to) { return j == to || !is_cut_in_v(i, std::min(j, to)); };
  float sum = 0;
  for (int c = 0; c < 4; ++c) {
    if (!(near->weight[c] > 0)) continue;
    const int i = near->index[c] % id.width(), j = near->index[c] / id.width();
    const bool linked = (open_u(i0, j0, i) && open_v(i, j0, j)) || (open_v(i0, j0, j) && open_u(i0, j, i));
    if (!linked) near->weight[c] = 0;
    sum += near->weight[c];
  }
  if (!(sum > 0)) return false;
  for (float& w : near->weight) w /= sum;
  return true;
}

uint64_t TileLinker::link(Scratch& s) const {
  uint64_t rays = 0;
  s.count = 0;
  for (int i = 0; i < s.job_count; ++i) {
    *s.jobs[i].links = {};
    const GridId& id = s.jobs[i].grid;
    if (id.cluster_level > 0 || (id.count() == 1 && !s.single_cells)) continue;
    if (std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(id.geometry))) continue;
    add_lines(s.jobs[i], s, &rays);
  }
  trace(s, &rays);
  for (int i = 0; i < s.job_count; ++i)
    if (s.jobs[i].links->divided != 0) {
      *s.jobs[i].links = {};
      add_ways(s.jobs[i], s, &rays);
    }
  trace(s, &rays);
  return rays;
}

// From edge to edge through the middles of all cells.
void TileLinker::add_lines(const Job& job, Scratch& s, uint64_t* rays) const {
  const float w = float(job.grid.width()), h = float(job.grid.height()), size = patches_->cell(job.grid).size;
  const TileLinks suspect{all_cells, 0};
  for (float j = 0.5f; j < h; ++j) add(job, {margin, j}, {w - margin, j}, size, suspect, s, rays);
  for (float i = 0.5f; i < w; ++i) add(job, {i, margin}, {i, h - margin}, size, suspect, s, rays);
}

// From each shading point to the next ones, and to the corners of its cell.
void TileLinker::add_ways(const Job& job, Scratch& s, uint64_t* rays) const {
  const int w = job.grid.width(), h = job.grid.height();
  const float size = patches_->cell(job.grid).size, corner = 0.5f - margin;
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      const V2f p(float(i) + 0.5f, float(j) + 0.5f);
      const int bit = TileLinks::bit(i, j);
      if (i + 1 < w) add(job, p, p + V2f(1, 0), size, {0, 1u << bit}, s, rays);
      if (j + 1 < h) add(job, p, p + V2f(0, 1), size, {0, 1u << (bit + 16)}, s, rays);
      for (const V2f& d : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)}) add(job, p, p + d * corner, size, {1u << bit, 0}, s, rays);
    }
}

void TileLinker::add(const Job& job, const V2f& from, const V2f& to, float cell_size, const TileLinks& if_blocked, Scratch& s,
                     uint64_t* rays) const {
  const int k = s.count++;
  V3f ends[2];
  for (const bool end : {false, true}) {
    const V2f& at = end ? to : from;
    patches_->place_on_tile(job.grid, at.x, at.y, &s.hits, k);
    const geom::SurfacePoint p = scene_.traced.surface(s.hits, k, PatchTable::shading_time);
    ends[end] = p.P + p.Ng * (std::max(p.error, height * cell_size) * (job.grid.behind ? -1.0f : 1.0f));
  }
  const V3f way = ends[1] - ends[0];
  const float length = dapple::length(way);
  const uint64_t key = hash(job.grid.hash(), std::bit_cast<uint32_t>(from.x), std::bit_cast<uint32_t>(from.y), if_blocked.cut);
  s.rays.set(k, ends[0], length > 0 ? way * (1 / length) : V3f(0, 0, 1), length, PatchTable::shading_time, uint32_t(key), length / 4);
  s.links[k] = job.links;
  s.if_blocked[k] = if_blocked;
  s.grid[k] = job.grid;
  s.cell_size[k] = cell_size;
  if (s.count == Scratch::capacity) trace(s, rays);
}

void TileLinker::trace(Scratch& s, uint64_t* rays) const {
  if (s.count == 0) return;
  scene_.traced.intersect(s.rays, s.count, &s.hits);
  for (int k = 0; k < s.count; ++k)
    if (blocks(s, k)) s.links[k]->divided |= s.if_blocked[k].divided, s.links[k]->cut |= s.if_blocked[k].cut;
  *rays += uint64_t(s.count);
  s.count = 0;
}

bool TileLinker::blocks(const Scratch& s, int ray) const {
  const uint32_t geometry = s.hits.geometry[ray];
  if (geometry == no_id || materials_.passes(geometry)) return false;
  if (std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(geometry))) return false;
  const GridId met = patches_->patch_of(s.hits, ray);
  const GridId& own = s.grid[ray];
  if (met.instance == own.instance && met.geometry == own.geometry && met.patch == own.patch) return false;
  return patches_->cell(met).size >= s.cell_size[ray];
}

}  // namespace dapple::integrate
