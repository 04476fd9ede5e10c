// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/irradiance_interpolator.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "dapple/distribution/interpolation_numbers.h"

namespace dapple::distribution {

using gi::TileCache;
using integrate::CacheState;
using integrate::PointBatch;
using integrate::RayOrigin;
using integrate::RaySet;
using integrate::share_out;
using scene::GridId;
using trace::RayBatch;
using Node = IrradianceInterpolator::Workspace::Node;

namespace {

using Numbers = InterpolationNumbers;
constexpr int max_step = Numbers::max_step;
constexpr int no_lattice = max_step;  // steps finer, where none would serve

// What is kept of a node, before its parts by groups of lights.
struct Kept {
  gi::IrradianceRecord record;
  V3f P, n;
  float glints;
};
constexpr int kept_words = sizeof(Kept) / sizeof(uint32_t),
              part_words = sizeof(gi::IrradianceRecord) / sizeof(uint32_t);
static_assert(sizeof(Kept) == kept_words * sizeof(uint32_t) &&
              sizeof(gi::IrradianceRecord) == part_words * sizeof(uint32_t));

// Of a point's hemispheres. What moves may turn by 90 degrees meanwhile: over a longer time its light is far from
// linear.
uint8_t hemisphere_span(const scene::Motion& motion, const GridId& id) {
  return motion.moves(id.instance, id.geometry) ? scene::Motion::around(scene::Motion::around(id.span)) : 0;
}

std::vector<gi::HemisphereStrata> strata_of_steps(int rays) {
  std::vector<gi::HemisphereStrata> strata;
  for (int step = 0; step <= max_step; ++step) {
    const int times = step < Numbers::first_wide ? 1 : 2 << (step - Numbers::first_wide);
    strata.emplace_back(std::max(rays, std::min(rays * times, Numbers::most_rays)));
  }
  return strata;
}

bool is_mine(const Node& n) {
  return n.found == TileCache::Found::mine;
}

}  // namespace

IrradianceInterpolator::IrradianceInterpolator(const ShadingScene& shading, const PointPlacer& placer,
                                               const DiffuseRays& diffuse_rays, const HitGatherer& gatherer,
                                               const Settings& settings)
    : shading_(shading),
      placer_(placer),
      diffuse_rays_(diffuse_rays),
      gatherer_(gatherer),
      patches_(*shading.patches),
      settings_(settings),
      strata_(strata_of_steps(settings.rays)),
      cache_(settings.bytes, kept_words + settings.light_groups * part_words) {}

IrradianceInterpolator::Workspace::Workspace(const IrradianceInterpolator& of) {
  const int most = of.strata_.back().count();
  L.resize(size_t(std::max(RaySet::capacity * PointBatch::most_ray_sets, most)));
  distance.resize(L.size());
  time.resize(L.size());
  part_L.resize(L.size() * size_t(of.settings_.light_groups));
  parts.resize(size_t(capacity * corners * of.settings_.light_groups));
  words.resize(size_t(of.cache_.words()));
}

void IrradianceInterpolator::unpack(int n, Workspace& w) const {
  const size_t groups = size_t(settings_.light_groups);
  Kept kept;
  std::memcpy(static_cast<void*>(&kept), w.words.data(), sizeof kept);
  w.node[n].record = kept.record, w.node[n].P = kept.P, w.node[n].n = kept.n, w.node[n].glints = kept.glints;
  if (groups > 0)
    std::memcpy(static_cast<void*>(&w.parts[size_t(n) * groups]), &w.words[kept_words], groups * sizeof w.parts[0]);
}

void IrradianceInterpolator::pack(int n, Workspace& w) const {
  const size_t groups = size_t(settings_.light_groups);
  const Kept kept{w.node[n].record, w.node[n].P, w.node[n].n, w.node[n].glints};
  std::memcpy(w.words.data(), &kept, sizeof kept);
  if (groups > 0) std::memcpy(&w.words[kept_words], &w.parts[size_t(n) * groups], groups * sizeof w.parts[0]);
}

CacheState IrradianceInterpolator::state() const {
  return {"hemispheres", {}, cache_.evictions(), cache_.bytes_in_use(), cache_.bytes_in_use(), cache_.bytes()};
}

void IrradianceInterpolator::interpolate(const Place& place, Workspace& w, ShadingWorkspace& s) const {
  PointBatch& b = s.level(place.level);
  b.some_indirect_known = true;
  int waiting[PointBatch::capacity], waiting_count = 0, next_step[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k) {
    b.indirect_known[k] = false;
    const scattering::Bsdf& bsdf = b.bsdf[k];
    if (bsdf.is_diffuse() && !bsdf.reflectance.is_black() && bsdf.transmittance.is_black() &&
        patches_.has_lattice(w.point[k].grid)) {
      waiting[waiting_count++] = k, next_step[k] = max_step;
      set_receiver(b, k, w);
    }
  }
  for (int step = max_step; step > 0 && waiting_count > 0; --step) {
    w.step = step;
    w.pending_count = w.order_count = w.quad_count = 0;
    for (int n = 0; n < waiting_count; ++n) {
      const int k = waiting[n];
      if (next_step[k] >= step && choose_nodes(w.point[k], w.pending_count, w)) w.pending[w.pending_count++] = k;
    }
    if (w.pending_count == 0) continue;
    list_nodes(w);
    find_nodes(place, w, s);
    for (int n = 0; n < w.pending_count; ++n) {
      const int k = w.pending[n];
      const int finer = blend(n, k, w, b);
      b.indirect_known[k] = finer == 0;
      if (finer == no_lattice) b.crowd[k] = std::max(b.crowd[k] / Numbers::unserved_share, 1);
      next_step[k] =
          step > w.point[k].finest_step && finer != no_lattice ? std::max(w.point[k].finest_step, step - finer) : 0;
    }
    waiting_count =
        int(std::remove_if(waiting, waiting + waiting_count, [&b](int k) { return b.indirect_known[k]; }) - waiting);
  }
}

// Where a point is in the middle of its hemispheres' time.
void IrradianceInterpolator::set_receiver(const PointBatch& b, int k, Workspace& w) const {
  const scene::Motion& motion = patches_.motion();
  const GridId& id = w.point[k].grid;
  const uint8_t span = hemisphere_span(motion, id);
  const V3f& n = b.bsdf[k].frame.n;
  w.receiver[k] = {b.surface[k].P, b.bsdf[k].side(b.wo[k]) < 0 ? -n : n, motion.since_middle(span, b.time[k])};
  if (!b.moves[k] || span == id.span) return;
  const geom::SurfacePoint s = placer_.surface_at(b, k, motion.middle(span));
  const V3f turn = s.Ns - b.surface[k].Ns;
  w.receiver[k].P = s.P, w.receiver[k].n = normalize(w.receiver[k].n + (id.behind ? -turn : turn));
}

// The nodes around a point on the lattice that is 2^w.step times as wide. False where there is none.
bool IrradianceInterpolator::choose_nodes(const Point& p, int n, Workspace& w) const {
  const int step = w.step;
  GridId id = p.grid;
  if (step > std::max(id.u_level, id.v_level)) return false;
  const float s = (float(id.tile_u * GridId::tile + uint32_t(p.i)) + 0.5f) / float(1u << id.u_level);
  const float t = (float(id.tile_v * GridId::tile + uint32_t(p.j)) + 0.5f) / float(1u << id.v_level);
  id.span = hemisphere_span(patches_.motion(), id);
  id.u_level = uint8_t(std::max(0, id.u_level - step)), id.v_level = uint8_t(std::max(0, id.v_level - step));
  const int columns = 1 << id.u_level, rows = 1 << id.v_level;
  const float x = std::clamp(s * float(columns) - 0.5f, 0.0f, float(columns - 1)),
              y = std::clamp(t * float(rows) - 0.5f, 0.0f, float(rows - 1));
  const int i0 = int(x), j0 = int(y);
  const float fx = x - float(i0), fy = y - float(j0);
  id.tile_u = id.tile_v = 0;
  const int q = quad(id, i0, j0, w);
  w.quad_of[n] = q;
  const uint32_t rays = uint32_t(
      strata_[size_t(step)].count());  // of the name: tiles of several rates ask for the same place at several steps
  bool any = false;
  for (int c = 0; c < w.corners; ++c) {
    float& weight = w.weight[n][c];
    weight = ((c & 1) ? fx : 1 - fx) * ((c >> 1) ? fy : 1 - fy);
    if (!(weight > 0)) continue;
    Workspace::Quad& of = w.quads[q];
    if (!(of.asked >> c & 1)) {
      of.asked |= uint8_t(1 << c);
      const uint32_t i = uint32_t(std::min(i0 + (c & 1), columns - 1)), j = uint32_t(std::min(j0 + (c >> 1), rows - 1));
      id.tile_u = i / GridId::tile, id.tile_v = j / GridId::tile;
      const Point at{id, int(i % GridId::tile), int(j % GridId::tile)};
      if (patches_.is_outside(id, at.i, at.j)) {
        of.outside |= uint8_t(1 << c);
      } else {
        const int index = q * w.corners + c;
        w.wanted[index] = at;
        w.order[w.order_count++] = {hash(id.hash(), id.index(at.i, at.j), rays), index};
      }
    }
    if (of.outside >> c & 1) weight = 0;
    any |= weight > 0;
  }
  return any;
}

// The number of four nodes; those of one of the last points, mostly.
int IrradianceInterpolator::quad(const GridId& lattice, int i, int j, Workspace& w) {
  constexpr int recent = 4;
  for (int q = w.quad_count - 1; q >= std::max(0, w.quad_count - recent); --q)
    if (w.quads[q].i == i && w.quads[q].j == j && w.quads[q].lattice == lattice) return q;
  w.quads[w.quad_count] = {lattice, i, j, 0, 0};
  return w.quad_count++;
}

// Each once.
void IrradianceInterpolator::list_nodes(Workspace& w) {
  std::sort(w.order, w.order + w.order_count);
  w.node_count = 0;
  for (int n = 0; n < w.order_count; ++n) {
    const auto [key, index] = w.order[n];
    if (n == 0 || key != w.node[w.node_count - 1].key) {
      Node& node = w.node[w.node_count++];
      node.at = w.wanted[index], node.key = key, node.found = TileCache::Found::refused;
    }
    w.node_of[index] = w.node_count - 1;
  }
  w.counts.lookups += uint64_t(w.node_count), w.counts.hits += uint64_t(w.node_count);
}

// Looks nodes up, and computes what is missing. As many are claimed as are computed together: of what several threads
// want, each computes a part.
void IrradianceInterpolator::find_nodes(const Place& place, Workspace& w, ShadingWorkspace& s) const {
  // Whatever happens, other threads must not wait for ever.
  struct Guard {
    TileCache& cache;
    Workspace& w;
    ~Guard() {
      for (int n = 0; n < w.node_count; ++n)
        if (is_mine(w.node[n])) cache.abandon(w.node[n].slot);
    }
  } guard{cache_, w};
  const int group = std::min(int(w.L.size()) / strata_[size_t(w.step)].count(), PointBatch::capacity);
  Node* nodes[PointBatch::capacity];
  int count = 0;
  for (int n = 0; n < w.node_count; ++n) {
    if (find_node(n, w)) continue;
    nodes[count++] = &w.node[n];
    if (count == group) compute(place, nodes, std::exchange(count, 0), w, s);
  }
  compute(place, nodes, count, w, s);
  // Whoever computes a hemisphere waits for the radiosity cache, never for hemispheres: no ring.
  for (int n = 0; n < w.node_count; ++n) {
    Node* const node = &w.node[n];
    if (node->found != TileCache::Found::pending) continue;
    if (cache_.wait(node->slot, w.words.data()))
      unpack(n, w);
    else if (!find_node(n, w) || node->found == TileCache::Found::pending)
      compute(place, &node, 1, w, s);
  }
}

// False where the caller has to compute it.
bool IrradianceInterpolator::find_node(int n, Workspace& w) const {
  Node& node = w.node[n];
  node.found = cache_.find(node.key, w.words.data(), &node.slot);
  if (node.found == TileCache::Found::ready) unpack(n, w);
  return node.found == TileCache::Found::ready || node.found == TileCache::Found::pending;
}

void IrradianceInterpolator::compute(const Place& place, Node* const* nodes, int count, Workspace& w,
                                     ShadingWorkspace& s) const {
  if (count == 0) return;
  const Timer timer;
  shoot(place, nodes, count, w, s);
  w.counts.fills += uint64_t(count), w.counts.hits -= uint64_t(count);
  for (int k = 0; k < count; ++k) {
    if (!is_mine(*nodes[k])) continue;
    pack(int(nodes[k] - w.node), w);
    cache_.publish(nodes[k]->slot, w.words.data());
    nodes[k]->found = TileCache::Found::ready;
  }
  w.counts.fill_seconds += timer.seconds();
}

// Computes up to as many hemispheres as there is room for.
void IrradianceInterpolator::shoot(const Place& place, Node* const* nodes, int count, Workspace& w,
                                   ShadingWorkspace& s) const {
  const Place here{place.level + 1, place.depth, place.arrival};
  PointBatch& b = s.level(here.level);
  const gi::HemisphereStrata& of_step = strata_[size_t(w.step)];
  const int strata = of_step.count(), all = count * strata;
  for (int k = 0; k < count; ++k) {
    const Point& at = nodes[k]->at;
    scene::PatchTable::Cell cell = patches_.cell(at.grid);
    cell.size *= Numbers::ray_width;
    placer_.place(at.grid, at.i, at.j, cell, nodes[k]->key, &s.extents, b, k);
    nodes[k]->P = b.surface[k].P;
    nodes[k]->n = at.grid.behind ? -b.surface[k].Ns : b.surface[k].Ns;
    nodes[k]->glints = 0;
  }
  b.count = count;
  shading_.find_media(b, s);
  for (int first = 0; first < all;) {
    int sets = 0, next = first;
    for (; sets < PointBatch::most_ray_sets && next < all; ++sets)
      next = fill_set(of_step, nodes, next, all, b, b.ray_set(sets));
    gatherer_.gather(here, sets, s);
    for (int set = 0; set < sets; ++set) first = collect(b.ray_set(set), strata, nodes, first, b, w);
  }
  const size_t groups = size_t(settings_.light_groups);
  for (int k = 0; k < count; ++k) {
    const size_t at = size_t(k * strata), node = size_t(nodes[k] - w.node);
    const float* time = b.duration[k] > 0 ? &w.time[at] : nullptr;
    nodes[k]->record = gi::integrate_hemisphere(of_step, &w.L[at], &w.distance[at], time);
    for (size_t g = 0; g < groups; ++g)
      w.parts[node * groups + g] =
          gi::integrate_hemisphere(of_step, &w.part_L[g * w.L.size() + at], &w.distance[at], time);
  }
}

// Rays through the strata of all hemispheres from number `next` on, in whole packets; returns the first that found no
// room.
int IrradianceInterpolator::fill_set(const gi::HemisphereStrata& of_step, Node* const* nodes, int next, int all,
                                     const PointBatch& b, RaySet& r) const {
  const int strata = of_step.count();
  DiffuseRays::Fan fan{-1, 0, 0, 0};
  for (r.count = 0; next < all; ++next) {
    const int k = next / strata, stratum = next % strata;
    const bool starts = stratum % RayBatch::packet == 0;
    if (starts && r.count + std::min(RayBatch::packet, strata - stratum) > RaySet::capacity) break;
    const uint64_t random = hash(b.key[k], stratum);
    const V3f local = of_step.direction(stratum, to_unit_float(random), to_unit_float(random << 24));
    const RayOrigin from = b.origin_of(k, stratum, uint32_t(b.key[k]));
    V3f d = Frame(from.normal(nodes[k]->n)).to_world(local);
    // What would leave through the surface is mirrored there, as interpolated normals may have it: as much light
    // arrives as at an even one.
    const float height = dot(d, from.Ng);
    if (height * dot(nodes[k]->n, from.Ng) < 0) d -= from.Ng * (2 * height);
    if (fan.point != k) fan = diffuse_rays_.fan(b, k, strata);
    diffuse_rays_.set(b, fan, r, r.count, from, d, local.z, uint32_t(random >> 8));
    r.rays.joined[r.count++] = !starts && RayBatch::pays_to_join(strata);
  }
  return next;
}

// What such rays found, of which the first is number `first`; returns the number after the last.
int IrradianceInterpolator::collect(const RaySet& r, int strata, Node* const* nodes, int first, const PointBatch& b,
                                    Workspace& w) const {
  for (int i = 0; i < r.count; ++i) {
    const int k = (first + i) / strata;
    const size_t to = size_t(first + i);
    w.L[to] = r.L[i];
    for (size_t g = 0; g < size_t(settings_.light_groups); ++g) w.part_L[g * w.L.size() + to] = r.L.parts(i)[g];
    w.distance[to] = r.distance[i];
    nodes[k]->glints += r.glint[i] * r.weight[i].luminance() * (pi / float(strata));
    w.time[to] = b.duration[k] > 0 ? (r.rays.time[i] - b.time[k]) / b.duration[k] : 0;
  }
  return first + r.count;
}

// Sets b.indirect[k] to what the nodes say of point k: 0, or if they are too far away, or do not agree, how many steps
// finer they should be. Whether they serve a still point does not depend on the time: what is refined is refined for
// all its segments.
int IrradianceInterpolator::blend(int n, int k, const Workspace& w, PointBatch& b) const {
  RGB value[Workspace::corners], sum;
  V3f way[Workspace::corners], turned[Workspace::corners];
  float all = 0, reach = 0, difference = 0, glints = 0;
  const auto& [P, normal, later] = w.receiver[k];
  for (int c = 0; c < w.corners; ++c) {
    const float weight = w.weight[n][c];
    if (!(weight > 0)) continue;
    const Node& node = w.node[w.node_of[w.quad_of[n] * w.corners + c]];
    const Frame frame(node.n);
    way[c] = frame.to_local(P - node.P), turned[c] = frame.to_local(normal);
    if (!(turned[c].z >= Numbers::least_cosine)) return 1;
    value[c] = node.record.at(way[c].x, way[c].y, turned[c]);
    sum += value[c] * weight;
    reach += weight * length(way[c]) / node.record.distance;
    glints += weight * node.glints;
    all += weight;
  }
  const float limit = w.step > w.point[k].finest_step || w.point[k].parted
                          ? settings_.accuracy
                          : std::max(settings_.accuracy, Numbers::finest_reach);
  if (!(reach <= limit * all)) return reach < Numbers::two_steps_beyond * settings_.accuracy * all ? 1 : 2;
  sum *= 1 / all;
  if (glints > Numbers::most_glints * settings_.accuracy * sum.luminance() * all) return no_lattice;
  for (int c = 0; c < w.corners; ++c) {
    if (!(w.weight[n][c] > 0)) continue;
    const RGB off = value[c] - sum;
    difference += w.weight[n][c] * std::max({std::abs(off.r), std::abs(off.g), std::abs(off.b)});
  }
  if (!(difference <= Numbers::tolerance * settings_.accuracy * sum.max() * all)) return 1;
  if (later != 0) {
    sum = RGB();
    for (int c = 0; c < w.corners; ++c)
      if (w.weight[n][c] > 0)
        sum += w.node[w.node_of[w.quad_of[n] * w.corners + c]].record.at(way[c].x, way[c].y, turned[c], later) *
               (w.weight[n][c] / all);
  }
  sum *= b.bsdf[k].mean_terminator();
  if (settings_.light_groups == 0) return b.indirect.set(k, {sum}), 0;
  RGB parts[scene::LightGroups::max_count];
  const size_t groups = size_t(settings_.light_groups);
  for (int c = 0; c < w.corners; ++c) {
    if (!(w.weight[n][c] > 0)) continue;
    const gi::IrradianceRecord* of_node = &w.parts[size_t(w.node_of[w.quad_of[n] * w.corners + c]) * groups];
    for (size_t g = 0; g < groups; ++g)
      parts[g] += of_node[g].at(way[c].x, way[c].y, turned[c], later) * w.weight[n][c];
  }
  share_out(sum, {parts, groups});  // none was below zero, nor was the sum
  b.indirect.set(k, {sum, parts});
  return 0;
}

}  // namespace dapple::distribution
