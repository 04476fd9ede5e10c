// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/tile_links.h"

#include <algorithm>

#include "dapple/gi/link_numbers.h"

namespace dapple::gi {

using scene::GridId;
using scene::PatchTable;
using trace::no_id;

bool TileLinks::restrict_to(const scene::GridPoint& at, PatchTable::Neighbours* near) const {
  if (!serves(at, near->nearest)) return false;
  const GridId& id = at.grid;
  if (id.cluster_level > 0 || (cut & ~suspects) == 0) return true;
  const int i0 = near->nearest % id.width(), j0 = near->nearest / id.width();
  const auto open_u = [&](int i, int j, int to) { return i == to || !is_cut_in_u(std::min(i, to), j); };
  const auto open_v = [&](int i, int j, int to) { return j == to || !is_cut_in_v(i, std::min(j, to)); };
  float sum = 0;
  bool all_linked = true;
  for (int c = 0; c < 4; ++c) {
    if (!(near->weight[c] > 0)) continue;
    const int i = near->index[c] % id.width(), j = near->index[c] / id.width();
    const bool linked = (open_u(i0, j0, i) && open_v(i, j0, j)) || (open_v(i0, j0, j) && open_u(i0, j, i));
    if (!linked) near->weight[c] = 0;
    all_linked &= linked;
    sum += near->weight[c];
  }
  if (all_linked)
    return true;  // to the last bit what it is where nobody has found yet what parts other points of the tile
  if (!(sum > 0)) return false;
  for (float& w : near->weight) w /= sum;
  return true;
}

uint64_t TileLinker::link(Scratch& s) const {
  uint64_t rays = 0;
  s.count = 0;
  for (int i = 0; i < s.job_count; ++i) {
    Job& job = s.jobs[i];
    if (job.known == 0) *job.links = {};
    const GridId& id = job.grid;
    // Between points of a half there may be a cell outside it: all at once.
    const bool at_once = id.cluster_level > 0 || patches_->is_half(id);
    if (at_once) job.wanted = job.known != 0 ? 0 : TileLinks::all_parts;
    if (std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(id.geometry))) job.wanted = 0;
    if (job.wanted == 0) continue;
    id.cluster_level > 0 ? add_parts(job, s, &rays) : add_lines(job, s, &rays);
  }
  trace(s, &rays);
  for (int i = 0; i < s.job_count; ++i)
    if (s.jobs[i].links->cut & TileLinks::suspects) add_ways(s.jobs[i], s, &rays);
  trace(s, &rays);
  return rays;
}

// From edge to edge, through the middles of all cells of the rows and columns of wanted points.
void TileLinker::add_lines(const Job& job, Scratch& s, uint64_t* rays) const {
  const int w = job.grid.width(), h = job.grid.height();
  const float size = patches_->cell(job.grid, &s.extents).width();
  const auto lines = [&](uint32_t points) {
    uint32_t found = 0;
    for (int j = 0; j < h; ++j)
      for (int i = 0; i < w; ++i)
        if (points >> job.grid.index(i, j) & 1) found |= TileLinks::row(j) | TileLinks::column(i);
    return found;
  };
  const uint32_t wanted = lines(job.wanted) & ~lines(job.known);
  for (int j = 0; j < h; ++j)
    if (wanted & TileLinks::row(j))
      add(job, {LinkNumbers::margin, float(j) + 0.5f}, {float(w) - LinkNumbers::margin, float(j) + 0.5f}, size,
          {0, TileLinks::row(j)}, s, rays);
  for (int i = 0; i < w; ++i)
    if (wanted & TileLinks::column(i))
      add(job, {float(i) + 0.5f, LinkNumbers::margin}, {float(i) + 0.5f, float(h) - LinkNumbers::margin}, size,
          {0, TileLinks::column(i)}, s, rays);
}

// From each wanted shading point in a line where something stands to the next ones in that line, and to the corners of
// its cell; those from the other side of the point, or they would miss a wall that stands just in it, as in the middle
// of a floor.
void TileLinker::add_ways(const Job& job, Scratch& s, uint64_t* rays) const {
  const int w = job.grid.width(), h = job.grid.height();
  const float size = patches_->cell(job.grid, &s.extents).width(), corner = 0.5f - LinkNumbers::margin,
              beyond = LinkNumbers::margin;
  const uint32_t suspects = job.links->cut & TileLinks::suspects;
  const auto is_wanted = [&](int i, int j) { return bool(job.wanted >> job.grid.index(i, j) & 1); };
  const auto is_new_pair = [&](int i, int j, int i1, int j1) {
    const auto is_there = [&](int u, int v) { return is_wanted(u, v) || (job.known >> job.grid.index(u, v) & 1); };
    return i1 < w && j1 < h && is_there(i, j) && is_there(i1, j1) && (is_wanted(i, j) || is_wanted(i1, j1));
  };
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i) {
      const V2f p(float(i) + 0.5f, float(j) + 0.5f);
      const int bit = TileLinks::bit(i, j);
      const bool in_row = suspects & TileLinks::row(j), in_column = suspects & TileLinks::column(i);
      if (in_row && is_new_pair(i, j, i + 1, j)) add(job, p, p + V2f(1, 0), size, {0, 1u << bit}, s, rays);
      if (in_column && is_new_pair(i, j, i, j + 1)) add(job, p, p + V2f(0, 1), size, {0, 1u << (bit + 16)}, s, rays);
      if (!(in_row || in_column) || !is_wanted(i, j)) continue;
      for (const V2f& d : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)})
        add(job, p - d * beyond, p + d * corner, size, {1u << bit, 0}, s, rays);
    }
}

// From the patch that stands for a group to both ends of its parts, where they lie in a surface with it.
void TileLinker::add_parts(const Job& job, Scratch& s, uint64_t* rays) const {
  const GridId& id = job.grid;
  const float side = id.behind ? -1.0f : 1.0f;
  GridId group = id;
  const geom::SurfacePoint from = patches_->choose_stand_in(&group, id.tile_u);
  geom::SurfacePoint ends[2 * geom::PatchClusters::most_parts];
  int parts[2 * geom::PatchClusters::most_parts], count = 0, elsewhere = 0;
  const int part_count = geom::PatchClusters::parts(id.cluster_level);
  for (int part = 0; part < part_count; ++part) {
    geom::SurfacePoint of_part[2];
    const int n = patches_->ends_of_part(id, part, of_part);
    for (int end = 0; end < n; ++end) {
      const V3f way = of_part[end].P - from.P;
      if (dot(of_part[end].Ng, from.Ng) < LinkNumbers::like_normals ||
          std::abs(dot(way, from.Ng)) > LinkNumbers::near_plane * length(way)) {
        if (4 * ++elsewhere <= part_count) continue;
        job.links->cut |= TileLinks::scattered;
        return;
      }
      ends[count] = of_part[end];
      parts[count++] = part;
    }
  }
  const float size = patches_->cell(id, &s.extents).size;
  for (int i = 0; i < count; ++i) {
    Way& way = new_way(job, size, {1u << parts[i], 0}, s, rays);
    way.P[0] = from.P, way.P[1] = ends[i].P;
    way.N[0] = from.Ng * side, way.N[1] = ends[i].Ng * side;
    way.error = std::max(from.error, ends[i].error);
    way.unit = length(way.P[1] - way.P[0]);
    way.key = uint32_t(hash(id.hash(), i));
  }
}

void TileLinker::add(const Job& job, const V2f& from, const V2f& to, float cell_size, const TileLinks& if_blocked,
                     Scratch& s, uint64_t* rays) const {
  Way& way = new_way(job, cell_size, if_blocked, s, rays);
  way.error = 0;
  for (const bool end : {false, true}) {
    const V2f& at = end ? to : from;
    const geom::SurfacePoint p = patches_->surface_on_tile(job.grid, at.x, at.y, patches_->time(job.grid), &s.extents);
    way.P[end] = p.P;
    way.N[end] = p.Ng * (job.grid.behind ? -1.0f : 1.0f);
    way.error = std::max(way.error, p.error);
  }
  way.key =
      uint32_t(hash(job.grid.hash(), std::bit_cast<uint32_t>(from.x), std::bit_cast<uint32_t>(from.y), if_blocked.cut));
}

TileLinker::Way& TileLinker::new_way(const Job& job, float cell_size, const TileLinks& if_blocked, Scratch& s,
                                     uint64_t* rays) const {
  if (s.count == Scratch::capacity) trace(s, rays);
  Way& way = s.ways[s.count++];
  way.links = job.links;
  way.if_blocked = if_blocked;
  way.grid = job.grid;
  way.cell_size = way.unit = cell_size;
  return way;
}

void TileLinker::trace(Scratch& s, uint64_t* rays) const {
  trace_at(LinkNumbers::height, 0, s, rays);
  int doubtful = 0;
  for (int k = 0; k < s.count; ++k) {
    const Obstacle o = obstacle(s, k);
    if (o == Obstacle::large) s.ways[k].part();
    if (o == Obstacle::small) s.ways[doubtful++] = s.ways[k];
  }
  s.count = doubtful;
  for (const LinkNumbers::Offset& o : LinkNumbers::other_ways) {
    trace_at(o.height, o.aside, s, rays);
    int blocked = 0;
    for (int k = 0; k < s.count; ++k)
      if (obstacle(s, k) != Obstacle::none) s.ways[blocked++] = s.ways[k];
    s.count = blocked;
  }
  for (int k = 0; k < s.count; ++k) s.ways[k].part();
  s.count = 0;
}

// Traces all ways, so many of their units above the surface and to the side.
void TileLinker::trace_at(float above, float aside, Scratch& s, uint64_t* rays) const {
  if (s.count == 0) return;
  for (int k = 0; k < s.count; ++k) {
    const Way& way = s.ways[k];
    V3f ends[2];
    for (const int end : {0, 1}) ends[end] = way.P[end] + way.N[end] * std::max(way.error, above * way.unit);
    const V3f d = ends[1] - ends[0];
    const float length = dapple::length(d);
    const V3f across = cross(way.N[0], d);
    const float sine = dapple::length(across);
    const V3f shift = sine > 0 ? across * (aside * way.unit / sine) : V3f(0, 0, 0);
    s.rays.set(k, ends[0] + shift, length > 0 ? d * (1 / length) : V3f(0, 0, 1), length, patches_->time(way.grid),
               way.key, length / 4);
  }
  scene_.traced.intersect(s.rays, s.count, &s.hits);
  *rays += uint64_t(s.count);
}

TileLinker::Obstacle TileLinker::obstacle(Scratch& s, int ray) const {
  const uint32_t geometry = s.hits.geometry[ray];
  if (geometry == no_id || materials_.passes(geometry)) return Obstacle::none;
  if (std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(geometry))) return Obstacle::none;
  const Way& way = s.ways[ray];
  if (patches_->is_of(way.grid, s.hits, ray)) return Obstacle::none;
  // What passes over a still surface divides nothing for all the time.
  const scene::Motion& motion = patches_->motion();
  if (motion.moves(s.hits.instance[ray], geometry) && !motion.moves(way.grid.instance, way.grid.geometry))
    return Obstacle::none;
  return patches_->cell(patches_->patch_of(s.hits, ray), &s.extents).size >= way.cell_size ? Obstacle::large
                                                                                           : Obstacle::small;
}

}  // namespace dapple::gi
