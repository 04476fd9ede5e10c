// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/patch_table.h"

#include <bit>

#include "dapple/base/hash.h"

namespace dapple::scene {

namespace {

/// One patch a primitive, measured where it is hit.
bool is_round(const trace::Shape& shape) {
  return std::holds_alternative<trace::QuadricPtr>(shape) || std::holds_alternative<trace::DisksPtr>(shape);
}

constexpr int max_level = 20;     // cells of a patch along an edge: 2^20
constexpr float small_patch = 2;  // micropolygons: a patch no longer than this is one point, else leaves would be many
constexpr float group_width = 1.75f;  // a box as wide as a micropolygon is has this diagonal, about
constexpr float grazing = 0.25f;      // micropolygons are at most 1 / this longer than wide on screen

// The rate whose cells are nearest to as wide as asked for, where the patch is so many of them long: of the square of
// that.
int level_of(float widths2) {
  if (!(widths2 > 1 && widths2 < infinity)) return 0;
  const uint32_t bits = std::bit_cast<uint32_t>(2 * widths2);
  return std::min((int(bits >> 23) - 127) / 2, max_level);  // half its exponent: of what rounds up
}

float across2(const V3f& v, float whole2, const V3f& d) {
  return std::max(whole2 - sqr(dot(v, d)), whole2 * sqr(grazing));
}

float across2(const V3f& v, const V3f& d) {
  return across2(v, length2(v), d);
}

// Cells from the corner of the tile that holds x in [0, 1].
float place(float x, int level, uint32_t* tile) {
  const float cells = std::bit_cast<float>((127 + level) << 23),
              at = std::clamp(x * cells, 0.0f, cells * one_minus_epsilon);
  const int cell = int(at);
  *tile = uint32_t(cell) / GridId::tile;
  return at - float(cell & ~(GridId::tile - 1));
}

}  // namespace

PatchTable::PatchTable(const trace::TracedScene& scene, Motion motion, PatchMemory* memory)
    : scene_(scene), motion_(std::move(motion)), geometries_(memory ? memory->of(scene) : PatchMemory().of(scene)) {}

V3f PatchTable::patch_point(uint32_t instance, uint32_t geometry, uint32_t patch, float s, float t) const {
  GridId grid;
  grid.instance = instance, grid.geometry = geometry;
  trace::HitBatch hit;
  set_hit(grid, patch, s, t, &hit, 0);
  return scene_.surface(hit, 0, dicing_time, false).P;
}

// Of a mesh's patch: from the middle of one edge to that of the opposite one; a half patch lacks two of them.
PatchTable::Extent PatchTable::extent(uint32_t instance, uint32_t geometry, uint32_t patch) const {
  if (const auto& map = geometries_[geometry].map) {
    V3f c[4];
    map->corners_at(*std::get<trace::MeshPtr>(scene_.shape(geometry)), patch, dicing_time, c);
    const bool half = map->is_half(patch);
    const V3f s = half ? c[1] - c[0] : (c[1] - c[0] + c[2] - c[3]) * 0.5f,
              t = half ? c[2] - c[1] : (c[3] - c[0] + c[2] - c[1]) * 0.5f;
    if (instance == trace::no_id) return {instance, geometry, patch, s, t};
    float m[3][4];
    scene_.instance_rows(instance, dicing_time, m);
    const auto world = [&m](const V3f& v) {
      V3f out;
      for (int i = 0; i < 3; ++i) out[i] = m[i][0] * v.x + m[i][1] * v.y + m[i][2] * v.z;
      return out;
    };
    return {instance, geometry, patch, world(s), world(t)};
  }
  const auto at = [&](float s, float t) { return patch_point(instance, geometry, patch, s, t); };
  return {instance, geometry, patch, at(1, 0.5f) - at(0, 0.5f), at(0.5f, 1) - at(0.5f, 0)};
}

const PatchTable::Extent& PatchTable::remembered_extent(uint32_t instance, uint32_t geometry, uint32_t patch,
                                                        Extents* memory) const {
  Extent& e = memory->of(instance, geometry, patch);
  if (e.instance != instance || e.geometry != geometry || e.patch != patch) e = extent(instance, geometry, patch);
  return e;
}

PatchTable::PatchHit PatchTable::patch_hit(const trace::HitBatch& hits, int i, const V3f& d, float time,
                                           const geom::SurfacePoint& p, Extents* memory) const {
  const uint32_t instance = hits.instance[i], geometry = hits.geometry[i];
  PatchHit hit;
  hit.instance = instance, hit.geometry = geometry, hit.patch = hits.primitive[i];
  hit.s = hits.u[i], hit.t = hits.v[i], hit.time = time;
  const trace::Shape& shape = scene_.shape(geometry);
  if (std::holds_alternative<trace::CurvesPtr>(shape)) return hit;
  hit.Ng = p.Ng;
  hit.behind = dot(p.Ng, d) > 0;
  if (is_round(shape)) {
    hit.s_length2 = across2(p.dPdu, d), hit.t_length2 = across2(p.dPdv, d);
    return hit;
  }
  if (const geom::PatchMap* map = geometries_[geometry].map.get()) {
    const auto at = map->patch_point(hit.patch, hit.s, hit.t);
    hit.patch = at.patch, hit.s = at.s, hit.t = at.t;
    hit.half = map->is_half(at.patch);
  }
  const Extent& e = remembered_extent(instance, geometry, hit.patch, memory);
  hit.s_length2 = across2(e.s, d), hit.t_length2 = across2(e.t, d);
  return hit;
}

bool PatchTable::flat_patch_hit(const trace::HitBatch& hits, int i, const V3f& d, float time, Extents* memory,
                                PatchHit* out) const {
  const uint32_t instance = hits.instance[i], geometry = hits.geometry[i];
  const geom::PatchMap* map = geometries_[geometry].map.get();
  if (!map) return false;
  const auto at = map->patch_point(hits.primitive[i], hits.u[i], hits.v[i]);
  const Facets& f = remembered_facets(instance, geometry, at.patch, memory);
  if (!f.known) return false;
  out->instance = instance, out->geometry = geometry, out->patch = at.patch;
  out->s = at.s, out->t = at.t, out->time = time;
  out->s_length2 = across2(f.s, f.s2, d), out->t_length2 = across2(f.t, f.t2, d);
  out->Ng = f.at({at.s, at.t}).Ng;
  out->behind = dot(out->Ng, d) > 0;
  out->half = f.half;
  return true;
}

bool PatchTable::dice(const PatchHit& hit, float width, GridPoint* out) const {
  // Field by field: what is read soon after must not wait for copies of the whole.
  GridId& grid = out->grid;
  grid.instance = hit.instance, grid.geometry = hit.geometry, grid.patch = out->patch = hit.patch;
  grid.cluster_level = 0;
  grid.behind = hit.behind;
  grid.span = motion_.any() ? motion_.span(hit.instance, hit.geometry, width, hit.time) : 0;
  out->part = 0;
  out->half = hit.half;
  const float least2 = sqr(small_patch * width);
  if (hit.s_length2 > least2 || hit.t_length2 > least2) {
    const float inverse2 = 1 / sqr(width);
    const int u_level = level_of(hit.s_length2 * inverse2), v_level = level_of(hit.t_length2 * inverse2);
    grid.u_level = uint8_t(u_level), grid.v_level = uint8_t(v_level);
    out->x = place(hit.s, u_level, &grid.tile_u), out->y = place(hit.t, v_level, &grid.tile_v);
    return true;
  }
  grid.tile_u = grid.tile_v = 0;
  grid.u_level = grid.v_level = 0;
  out->x = out->y = 0;
  if (hit.s_length2 < 0) return false;
  choose_group(width, out);
  return true;
}

void PatchTable::refine(const PatchHit& hit, float half_width, GridPoint* place) const {
  GridId& grid = place->grid;
  // Where a side is a single cell, that may be long or short.
  if (std::min(grid.u_level, grid.v_level) == 0 || std::max(grid.u_level, grid.v_level) == max_level || motion_.any()) {
    dice(hit, half_width, place);
    return;
  }
  constexpr float middle = GridId::tile / 2;
  const auto halve = [](uint32_t* tile, float* x) {
    const bool second = *x >= middle;
    *tile = 2 * *tile + second;
    *x = 2 * (*x - middle * float(second));
  };
  ++grid.u_level, ++grid.v_level;
  halve(&grid.tile_u, &place->x);
  halve(&grid.tile_v, &place->y);
}

// The largest group of the patch that is no wider than asked for, if there is one. Groups are measured in the mesh's
// own space.
void PatchTable::choose_group(float width, GridPoint* out) const {
  const geom::PatchClusters* clusters = geometries_[out->grid.geometry].clusters.get();
  if (!clusters) return;
  const float scale = scene_.instance_scale(out->grid.instance);
  for (int k = 1; k <= clusters->levels(); ++k) {
    const uint32_t group = clusters->group(out->patch, k);
    if (!(clusters->diameter(group, k) * scale <= group_width * width)) break;
    out->grid.patch = group;
    out->grid.cluster_level = uint8_t(k);
  }
  if (out->grid.cluster_level > 0) out->part = uint8_t(clusters->part(out->patch, out->grid.cluster_level));
}

GridId PatchTable::stand_in(const GridId& group, uint32_t choice) const {
  GridId patch;
  patch.instance = group.instance, patch.geometry = group.geometry, patch.behind = group.behind,
  patch.span = group.span;
  patch.patch = geometries_[group.geometry].clusters->representative(group.patch, group.cluster_level, choice);
  return patch;
}

geom::SurfacePoint PatchTable::choose_stand_in(GridId* group, uint32_t choice) const {
  group->tile_u = choice;
  trace::HitBatch point;
  shading_point(*group, 0, 0, &point, 0);
  return scene_.surface(point, 0, time(*group));
}

int PatchTable::ends_of_part(const GridId& group, int part, geom::SurfacePoint ends[2]) const {
  uint32_t patches[2];
  if (!geometries_[group.geometry].clusters->ends_of_part(group.patch, group.cluster_level, part, patches)) return 0;
  const int count = patches[0] == patches[1] ? 1 : 2;
  for (int end = 0; end < count; ++end) {
    GridId patch;
    patch.instance = group.instance, patch.geometry = group.geometry, patch.patch = patches[end];
    trace::HitBatch point;
    shading_point(patch, 0, 0, &point, 0);
    ends[end] = scene_.surface(point, 0, time(group));
  }
  return count;
}

bool PatchTable::is_of(const GridId& grid, const trace::HitBatch& hits, int i) const {
  if (hits.instance[i] != grid.instance || hits.geometry[i] != grid.geometry) return false;
  const uint32_t patch = patch_of(hits, i).patch;
  return grid.patch ==
         (grid.cluster_level > 0 ? geometries_[grid.geometry].clusters->group(patch, grid.cluster_level) : patch);
}

void PatchTable::turn_group(const V3f& Ng, uint32_t patch, GridId* group) const {
  for (uint32_t choice = 0; choice < stand_ins; ++choice)
    if (dot(choose_stand_in(group, choice).Ng, Ng) > alike) return;
  group->patch = patch;
  group->cluster_level = 0, group->tile_u = 0;
}

PatchTable::Cell PatchTable::cell(const GridId& grid, Extents* memory) const {
  if (grid.cluster_level > 0)
    return {geometries_[grid.geometry].clusters->diameter(grid.patch, grid.cluster_level) *
            scene_.instance_scale(grid.instance)};
  const float nu = float(1u << grid.u_level), nv = float(1u << grid.v_level);
  const trace::Shape& shape = scene_.shape(grid.geometry);
  Extent e;
  if (is_round(shape)) {
    trace::HitBatch hit;
    shading_point(grid, grid.width() / 2, grid.height() / 2, &hit, 0);
    const geom::SurfacePoint p = scene_.surface(hit, 0, dicing_time);
    e.s = p.dPdu, e.t = p.dPdv;
  } else {
    e = memory ? remembered_extent(grid.instance, grid.geometry, grid.patch, memory)
               : extent(grid.instance, grid.geometry, grid.patch);
  }
  const V3f s = e.s * (1 / nu), t = e.t * (1 / nv);
  return {std::sqrt(std::max(length2(s), length2(t))), s, t};
}

float PatchTable::seen_length(const Cell& cell, const V3f& d) {
  return std::sqrt(std::max(across2(cell.s, d), across2(cell.t, d)));
}

PatchTable::Neighbours PatchTable::neighbours(const GridPoint& at) const {
  const GridId& id = at.grid;
  const float x = std::clamp(at.x - 0.5f, 0.0f, float(id.width() - 1)),
              y = std::clamp(at.y - 0.5f, 0.0f, float(id.height() - 1));
  const int i0 = int(x), j0 = int(y);
  const float fx = x - float(i0), fy = y - float(j0);
  Neighbours n;
  if (!is_half(id)) {
    for (int c = 0; c < 4; ++c) {
      n.weight[c] = ((c & 1) ? fx : 1 - fx) * ((c >> 1) ? fy : 1 - fy);
      n.index[c] = id.index(std::min(i0 + (c & 1), id.width() - 1), std::min(j0 + (c >> 1), id.height() - 1));
    }
    n.nearest = n.index[(fx >= 0.5f ? 1 : 0) + (fy >= 0.5f ? 2 : 0)];  // that of the cell which holds the place
    return n;
  }
  float sum = 0, largest = -1;
  for (int c = 0; c < 4; ++c) {
    const int i = std::min(i0 + (c & 1), id.width() - 1), j = std::min(j0 + (c >> 1), id.height() - 1);
    n.weight[c] = is_outside(id, i, j) ? 0 : ((c & 1) ? fx : 1 - fx) * ((c >> 1) ? fy : 1 - fy);
    n.index[c] = id.index(i, j);
    sum += n.weight[c];
    if (n.weight[c] > largest) largest = n.weight[c], n.nearest = n.index[c];
  }
  if (!(sum > 0)) {  // rounding at the diagonal of a half: the cell that holds the place
    n.nearest = at.cell();
    for (int c = 0; c < 4; ++c) n.index[c] = n.nearest, n.weight[c] = 0.25f;
    return n;
  }
  for (float& w : n.weight) w /= sum;
  return n;
}

bool PatchTable::has_lattice(const GridId& grid) const {
  return grid.cluster_level == 0;
}

bool PatchTable::is_half(const GridId& grid) const {
  const auto& map = geometries_[grid.geometry].map;
  return map && grid.cluster_level == 0 && map->is_half(grid.patch);
}

bool PatchTable::is_outside(const GridId& grid, int i, int j) const {
  if (!is_half(grid)) return false;
  // The lattice may be finer along one side: a cell is out where its corner of largest s - t is.
  const float s = float(grid.tile_u * GridId::tile + uint32_t(i) + 1) / float(1u << grid.u_level);
  const float t = float(grid.tile_v * GridId::tile + uint32_t(j)) / float(1u << grid.v_level);
  return s <= t;
}

void PatchTable::shading_point(const GridId& grid, int i, int j, trace::HitBatch* hits, int lane) const {
  const ShapePatches& patches = geometries_[grid.geometry];
  const bool group = grid.cluster_level > 0;
  const uint32_t patch = group ? stand_in(grid, grid.tile_u).patch : grid.patch;
  const float nu = float(1u << grid.u_level), nv = float(1u << grid.v_level);
  const float i0 = group ? 0 : float(grid.tile_u * GridId::tile) + float(i),
              j0 = float(grid.tile_v * GridId::tile) + float(j);
  float s = (i0 + 0.5f) / nu, t = (j0 + 0.5f) / nv;
  // The cell's centroid within a half patch: corners that are cut off move to the diagonal.
  if (patches.map && patches.map->is_half(patch) && t * nv + 0.5f > (s * nu - 0.5f) / nu * nv) {
    const float s0 = i0 / nu, s1 = (i0 + 1) / nu, t0 = j0 / nv, t1 = std::min((j0 + 1) / nv, s1);
    s = (std::max(s0, t0) + s1 + s1) / 3;
    t = (t0 + t0 + t1) / 3;
    t = std::min(t, s);
  }
  set_hit(grid, patch, s, t, hits, lane);
}

void PatchTable::set_hit(const GridId& grid, uint32_t patch, float s, float t, trace::HitBatch* hits, int lane) const {
  const auto& map = geometries_[grid.geometry].map;
  const auto f = map ? map->face_point(patch, s, t) : geom::PatchMap::FacePoint{patch, s, t};
  hits->instance[lane] = grid.instance, hits->geometry[lane] = grid.geometry;
  hits->primitive[lane] = f.face, hits->u[lane] = f.u, hits->v[lane] = f.v;
}

// (s, t) of a place on a tile.
V2f PatchTable::place_in_patch(const GridId& grid, float x, float y) const {
  const bool half = geometries_[grid.geometry].map && geometries_[grid.geometry].map->is_half(grid.patch);
  // Beyond the diagonal: what a cell lacks there, its other half has twice.
  if (half && grid.u_level == grid.v_level && grid.tile_u == grid.tile_v && int(x) == int(y) && y > x) std::swap(x, y);
  const float s = (float(grid.tile_u * GridId::tile) + x) / float(1u << grid.u_level);
  const float t = (float(grid.tile_v * GridId::tile) + y) / float(1u << grid.v_level);
  return {s, half ? std::min(t, s) : t};
}

void PatchTable::place_on_tile(const GridId& grid, float x, float y, trace::HitBatch* hits, int lane) const {
  const V2f at = place_in_patch(grid, x, y);
  set_hit(grid, grid.patch, at.x, at.y, hits, lane);
}

PatchTable::Facets PatchTable::facets(uint32_t instance, uint32_t geometry, uint32_t patch) const {
  Facets f;
  f.instance = instance, f.geometry = geometry, f.patch = patch;
  const auto& map = geometries_[geometry].map;
  if (!map || (instance != trace::no_id && scene_.is_animated(instance))) return f;
  const geom::Mesh& mesh = *std::get<trace::MeshPtr>(scene_.shape(geometry));
  if (!mesh.N.empty() || !mesh.P_end.empty()) return f;
  GridId grid;
  grid.instance = instance, grid.geometry = geometry;
  const auto at = [&](float s, float t) {
    trace::HitBatch hit;
    set_hit(grid, patch, s, t, &hit, 0);
    return scene_.surface(hit, 0, dicing_time, false);
  };
  f.known = true;
  f.falling = mesh.corners == 4;
  const Extent e = extent(instance, geometry, patch);
  f.s = e.s, f.t = e.t;
  f.s2 = length2(e.s), f.t2 = length2(e.t);
  const bool half = f.half = map->is_half(patch);
  const geom::SurfacePoint a = at(0, 0), b = at(1, 0), c = at(1, 1), d = half ? c : at(0, 1);
  const float error = 1.5f * std::max({a.error, b.error, c.error, d.error});
  f.facet[0] = {a.P, b.P - a.P, f.falling ? d.P - a.P : c.P - b.P, a.Ng, error};
  f.facet[1] = f.falling ? Facets::Facet{b.P + d.P - c.P, c.P - d.P, c.P - b.P, c.Ng, error}
                         : Facets::Facet{a.P, c.P - d.P, d.P - a.P, d.Ng, error};
  return f;
}

const PatchTable::Facets& PatchTable::remembered_facets(uint32_t instance, uint32_t geometry, uint32_t patch,
                                                        Extents* memory) const {
  Facets& f = memory->facets(instance, geometry, patch);
  if (f.instance != instance || f.geometry != geometry || f.patch != patch) f = facets(instance, geometry, patch);
  return f;
}

geom::SurfacePoint PatchTable::surface_on_tile(const GridId& grid, float x, float y, float time,
                                               Extents* memory) const {
  const Facets& f = remembered_facets(grid.instance, grid.geometry, grid.patch, memory);
  if (!f.known) {
    trace::HitBatch hit;
    place_on_tile(grid, x, y, &hit, 0);
    return scene_.surface(hit, 0, time, false);
  }
  const V2f at = place_in_patch(grid, x, y);
  const Facets::Facet& facet = f.at(at);
  geom::SurfacePoint s;
  s.P = facet.P + facet.s * at.x + facet.t * at.y;
  s.Ng = s.Ns = facet.Ng;
  s.error = facet.error;
  return s;
}

GridId PatchTable::patch_of(const trace::HitBatch& hits, int i) const {
  const auto& map = geometries_[hits.geometry[i]].map;
  GridId id;
  id.instance = hits.instance[i], id.geometry = hits.geometry[i];
  id.patch = map ? map->patch_point(hits.primitive[i], hits.u[i], hits.v[i]).patch : hits.primitive[i];
  return id;
}

}  // namespace dapple::scene
