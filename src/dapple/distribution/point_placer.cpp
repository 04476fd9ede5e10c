// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/point_placer.h"

#include <bit>

#include "dapple/distribution/cache_numbers.h"
#include "dapple/gi/link_numbers.h"

namespace dapple::distribution {

using gi::LinkNumbers;
using gi::TileLinks;
using integrate::PointBatch;
using integrate::RayOrigin;

namespace {

// A time of the span of point k, in one of as many parts of it as there are origins.
float time_of_origin(const PointBatch& b, int k, int o) {
  const uint64_t random = random_of(b.key[k], Purpose::origin_times, o);
  const int parts = b.origins[k], part = int((uint64_t(o) + b.key[k]) % uint64_t(parts));
  return b.time[k] + b.duration[k] * ((float(part) + to_unit_float(random)) / float(parts) - 0.5f);
}

}  // namespace

void PointPlacer::place(const scene::GridId& id, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                        scene::PatchTable::Extents* memory, PointBatch& b, int k) const {
  place_middle(id, i, j, cell, key, memory, b, k);
  if (!b.moves[k]) return;
  b.origins[k] = PointBatch::few_origins;
  float times[PointBatch::few_origins];
  geom::SurfacePoint at[PointBatch::few_origins];
  for (int o = 0; o < PointBatch::few_origins; ++o) times[o] = time_of_origin(b, k, o);
  shading_.scene.traced.surfaces(b.place(k), PointBatch::lane(k), times, at);
  for (int o = 0; o < PointBatch::few_origins; ++o)
    b.origin[k * PointBatch::most_origins + o] = {at[o].P, at[o].Ng, at[o].Ns - b.surface[k].Ns, at[o].error, times[o]};
}

void PointPlacer::place_cached_cell(const scene::GridId& id, int i, int j, const scene::PatchTable::Cell& cell,
                                    uint64_t key, int depth, const TileLinks& links, scene::PatchTable::Extents* memory,
                                    PointBatch& b, int k) const {
  place_middle(id, i, j, cell, key, memory, b, k);
  if (id.cluster_level > 0 && links.is_scattered())
    b.share[k] *= CacheNumbers::scattered_share;
  else if (shading_.readers->knows(depth))
    b.effort[k] = std::max(shading_.cell_effort({b.surface[k].P, b.wo[k]}, depth, shading_.read_cell(id, memory)), 1);
  else
    b.effort[k] =
        int(std::bit_floor(uint32_t(std::clamp(cell.area() / shading_.common_area, 1.0f, CacheNumbers::most_effort))));
  b.throughput[k] = 1 / CacheNumbers::filled_rays_at(depth);
  b.origins[k] = b.effort[k] >= CacheNumbers::many_origins_effort ? PointBatch::most_origins : PointBatch::few_origins;
  spread_origins(id, i, j, links, true, memory, b, k);
}

void PointPlacer::place_seen_cell(const scene::GridId& id, int i, int j, const scene::PatchTable::Cell& cell,
                                  uint64_t key, const TileLinks& links, scene::PatchTable::Extents* memory,
                                  PointBatch& b, int k) const {
  // A cell that something divides is read between this point and others on its side.
  if (links.is_divided(i, j)) return place(id, i, j, cell, key, memory, b, k);
  place_middle(id, i, j, cell, key, memory, b, k);
  b.origins[k] = shading_.settings.shadow_rays.at(0) < PointBatch::most_origins ? PointBatch::few_origins
                                                                                : PointBatch::most_origins;
  spread_origins(id, i, j, links, false, memory, b, k);
  if (b.moves[k]) shading_.patches->shading_point(id, i, j, &b.place(k), PointBatch::lane(k));
}

void PointPlacer::place_middle(const scene::GridId& id, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                               scene::PatchTable::Extents* memory, PointBatch& b, int k) const {
  const scene::Motion& motion = shading_.patches->motion();
  const bool tangents = shading_.materials.needs_tangents(id.geometry);
  b.geometry[k] = id.geometry;
  b.time[k] = shading_.patches->time(id);
  b.moves[k] = motion.any() && motion.moves(id.instance, id.geometry);
  if (!tangents && !b.moves[k] && shading_.patches->has_lattice(id) && !shading_.patches->is_half(id)) {
    b.surface[k] = shading_.patches->surface_on_tile(id, float(i) + 0.5f, float(j) + 0.5f, b.time[k], memory);
  } else {
    shading_.patches->shading_point(id, i, j, &b.place(k), PointBatch::lane(k));
    b.surface[k] = shading_.scene.traced.surface(b.place(k), PointBatch::lane(k), b.time[k], tangents);
  }
  b.wo[k] = id.behind ? -b.surface[k].Ng : b.surface[k].Ng;
  b.width[k] = cell.size;
  b.cell_s[k] = cell.s, b.cell_t[k] = cell.t;
  b.origins[k] = 0;
  b.spread[k] = 0;
  b.wavelength[k] = 0;
  b.medium[k] = shading_.surface_media.declared(id.geometry, id.behind, id.medium);
  b.set_key(k, hash(shading_.settings.seed, key, id.index(i, j)));
  b.share[k] = motion.segments(id.span);
  b.crowd[k] = b.effort[k] = 1;
  b.throughput[k] = 1;
  b.duration[k] = motion.any() ? motion.duration(id.span) : 0;
}

void PointPlacer::spread_origins(const scene::GridId& id, int i, int j, const TileLinks& links, bool of_mean,
                                 scene::PatchTable::Extents* memory, PointBatch& b, int k) const {
  const geom::SurfacePoint middle = b.surface[k];
  // Patterns are seen at one of the origins, at another in each of four neighbouring cells: at the middles of cells,
  // those that are as regular as cells would be seen in one phase alone.
  int seen_from = -1;
  if (of_mean && shading_.materials.varies(id.geometry) && id.cluster_level == 0)
    seen_from =
        ((i & 1) | (j & 1) << 1) ^ int(random_of(id.hash(), Purpose::patterns, i / 2, j / 2) % PointBatch::few_origins);
  const int side = b.origins[k] == PointBatch::few_origins ? 2 : 4;
  RayOrigin* const origin = b.origin + k * PointBatch::most_origins;
  for (int o = 0; o < b.origins[k]; ++o) {
    RayOrigin& to = origin[o];
    const float time = b.moves[k] ? time_of_origin(b, k, o) : b.time[k];
    const auto stay = [&] {
      geom::SurfacePoint s = middle;
      if (b.moves[k]) {
        shading_.patches->shading_point(id, i, j, &b.place(k), PointBatch::lane(k));
        s = surface_at(b, k, time);
      }
      to = {s.P, s.Ng, s.Ns - middle.Ns, s.error, time};
    };
    const uint64_t random = random_of(b.key[k], Purpose::origins, o);
    V2f at(to_unit_float(random), to_unit_float(random << 24));
    geom::SurfacePoint s;
    if (id.cluster_level > 0) {
      const scene::GridId patch =
          shading_.patches->stand_in(id, id.tile_u + uint32_t(o) * scene::PatchTable::stand_ins);
      if (links.divided >> shading_.patches->part(id, patch.patch) & 1) {
        stay();
        continue;
      }
      shading_.patches->place_on_tile(patch, at.x, at.y, &b.place(k), PointBatch::lane(k));
      s = surface_at(b, k, time);
    } else {
      // What is nearer to the edges may be behind a wall.
      const float low = LinkNumbers::margin, high = 1 - low;
      at = (V2f(float(o % side), float(o / side)) + at) * (1 / float(side));
      at = V2f(float(i), float(j)) + V2f(std::clamp(at.x, low, high), std::clamp(at.y, low, high));
      if (o == seen_from) {
        shading_.patches->place_on_tile(id, at.x, at.y, &b.place(k), PointBatch::lane(k));
        s = shading_.scene.traced.surface(b.place(k), PointBatch::lane(k), time);
      } else {
        s = shading_.patches->surface_on_tile(id, at.x, at.y, time, memory);
      }
    }
    // A leaf that is turned, half a patch, or the seam of a sphere: what is on its other side does not count.
    if (!(dot(s.Ng, middle.Ng) > (id.cluster_level > 0 ? scene::PatchTable::alike : 0))) {
      stay();
      continue;
    }
    to = {s.P, s.Ng, s.Ns - middle.Ns, s.error, time};
    if (o == seen_from) b.surface[k] = s;
  }
  if (seen_from < 0) return;
  const V3f turn = middle.Ns - b.surface[k].Ns;
  for (int o = 0; o < b.origins[k]; ++o) origin[o].turn += turn;
}

}  // namespace dapple::distribution
