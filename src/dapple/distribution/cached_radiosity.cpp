// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/cached_radiosity.h"

#include <bit>

#include "dapple/distribution/cache_numbers.h"

namespace dapple::distribution {

using gi::CacheBatch;
using gi::RadiosityCache;
using gi::TileCache;
using gi::TileLinks;
using integrate::PointBatch;
using integrate::RaySet;
using integrate::resolution_count;
using trace::no_id;

namespace {

using Numbers = CacheNumbers;

constexpr int most_halvings = 12;  // of a tile near a light
// For an entry that others keep adding to, or replacing; then it is computed twice.
constexpr int most_waits = 8;
// Points that a thread claims at a time: of what several threads want, each computes a part, where one would compute
// all and the others wait.
constexpr int most_claimed = 256;
constexpr int looked_ahead = 8;  // entries whose memory is on its way

// Entries are claimed while a batch is under way: whatever happens, other threads must not wait for them for ever.
class ClaimGuard {
 public:
  ClaimGuard(RadiosityCache& cache, CacheBatch& c) : cache_(cache), c_(c) {}
  ~ClaimGuard() {
    for (int e = 0; e < c_.entry_count; ++e)
      if (c_.entry[e].found == TileCache::Found::mine) cache_.abandon(c_.entry[e]);
  }
  void publish(int begin, int end) {
    for (int e = begin; e < end; ++e)
      if (c_.entry[e].found == TileCache::Found::mine) cache_.publish(c_.entry[e]);
  }
  ClaimGuard(const ClaimGuard&) = delete;
  ClaimGuard& operator=(const ClaimGuard&) = delete;

 private:
  RadiosityCache& cache_;
  CacheBatch& c_;
};

}  // namespace

CachedRadiosity::CachedRadiosity(const ShadingScene& shading, const PointPlacer& placer, const PointShader& shader,
                                 RadiosityCache* radiosity, RadiosityCache* irradiance)
    : shading_(shading),
      placer_(placer),
      shader_(shader),
      open_origins_(shading),
      radiosity_(radiosity),
      irradiance_(irradiance),
      widest_cell_(std::sqrt(Numbers::largest_cell * shading.common_area)) {}

float CachedRadiosity::growth(const Place& place, int share) const {
  if (place.depth.diffuse == 0) return Numbers::most_growth;
  return std::clamp(Numbers::growth_of_one_ray / float(std::max(shading_.settings.diffuse_ray_count(place, share), 1)),
                    Numbers::least_growth, Numbers::most_growth);
}

float CachedRadiosity::group_width() const {
  const float width = shading_.settings.cache_width;
  return std::max(width, std::min(Numbers::group_width * width, Numbers::most_group_width));
}

// Whether a source of light is so near a tile, for the size of its cells, that their few rays would find the spot that
// it throws there by chance, and thousands of rays read what they found.
bool CachedRadiosity::lies_near_light(const scene::GridId& tile, ShadingWorkspace& w) const {
  if (!shading_.scene.light_sampler || !shading_.patches->has_lattice(tile)) return false;
  NearLights::Known& known = w.near_lights.of(tile);
  if (known.tile != tile) {
    const scene::PatchTable::Cell cell = shading_.patches->cell(tile, &w.extents);
    trace::HitBatch middle;
    shading_.patches->place_on_tile(tile, 0.5f * float(tile.width()), 0.5f * float(tile.height()), &middle, 0);
    const float time = shading_.patches->time(tile);
    const V3f P = shading_.scene.traced.surface(middle, 0, time, false).P;
    const float reach = (0.71f * float(std::max(tile.width(), tile.height())) + Numbers::near_lights) * cell.size;
    known = {tile, shading_.scene.light_sampler->nearest({P, V3f(0, 0, 0), time}, reach) < reach};
  }
  return known.near;
}

// Dices what a ray hit by the width of what the ray stands for: hit, width, c.point[c.count]. False where no tile
// serves it.
bool CachedRadiosity::dice_hit(const PointBatch& b, const Place& below, const RaySet& r, int i, float growth,
                               scene::PatchTable::PatchHit* hit, float* width, scene::GridPoint* at,
                               ShadingWorkspace& w) const {
  const uint32_t geometry = r.hits.geometry[i];
  if (geometry == no_id || r.weight[i].is_black() || !shading_.materials.is_flat(geometry)) return false;
  const V3f d = r.rays.direction(i);
  const float time = r.rays.time[i];
  if (!shading_.patches->flat_patch_hit(r.hits, i, d, time, &w.extents, hit))
    *hit = shading_.patches->patch_hit(r.hits, i, d, time,
                                       shading_.scene.traced.surface_without_tangents(r.rays, r.hits, i), &w.extents);
  const auto dice = [&](float cache_width, float widest) {
    *width = std::min(width_read(b, r, i, growth, cache_width), widest);
    return shading_.patches->dice(*hit, *width, at);
  };
  const bool counted = below.arrival == Arrival::diffuse && shading_.is_cheap(geometry);
  const float widest = counted ? shading_.readers->widest(reader_of(r, i), below.depth.diffuse) : infinity;
  if (!shading_.patches->has_groups(geometry)) return dice(shading_.settings.cache_width, widest);
  if (!dice(group_width(), infinity)) return false;
  // Few rays read the mean of a group of leaves: where shading is cheap, they are answered by going on.
  if (at->grid.cluster_level > 0 && shading_.is_cheap(geometry)) return false;
  return at->grid.cluster_level > 0 || (group_width() == shading_.settings.cache_width && *width <= widest) ||
         dice(shading_.settings.cache_width, widest);
}

ReadCell CachedRadiosity::cell_read(const PointBatch& b, const Place& below, const RaySet& r, int i, float growth,
                                    ShadingWorkspace& w) const {
  scene::PatchTable::PatchHit hit;
  scene::GridPoint at;
  float width;
  return dice_hit(b, below, r, i, growth, &hit, &width, &at, w) ? shading_.read_cell(at.grid, &w.extents) : ReadCell();
}

bool CachedRadiosity::is_read_enough(const Place& below, const RaySet& r, int i, const scene::GridId& tile,
                                     ShadingWorkspace& w) const {
  const int depth = below.depth.diffuse;
  return below.arrival != Arrival::diffuse || !shading_.readers->knows(depth) ||
         !shading_.is_cheap(r.hits.geometry[i]) ||
         shading_.cell_effort(reader_of(r, i), depth, shading_.read_cell(tile, &w.extents)) > 0;
}

// The entry of a tile: `at`, or where that is near a light a finer one.
int CachedRadiosity::entry_at(const Place& below, const RaySet& r, int i, const scene::PatchTable::PatchHit& hit,
                              float width, scene::GridPoint* at, CacheBatch& c, ShadingWorkspace& w) const {
  // By tile, not by the place of the hit: what is read beside the spot that a lamp throws must not hold the spot
  // either.
  uint32_t slot = 0;
  bool near_light = false;
  for (int halvings = 0;; ++halvings) {
    if (shading_.surface_media.by_ray()) at->grid.medium = shading_.surface_media.name(r.hits.geometry[i], r.medium[i]);
    slot = at->grid.slot();
    const int known = c.answer(at->grid, slot);
    if (known >= 0) return known;
    near_light = known == CacheBatch::near_light || lies_near_light(at->grid, w);
    if (!near_light || halvings == most_halvings) break;
    if (known == CacheBatch::unknown) c.set_answer(at->grid, slot, CacheBatch::near_light);
    shading_.patches->refine(hit, width *= 0.5f, at);
  }
  const scene::Motion& motion = shading_.patches->motion();
  const bool among_movers = motion.any() && !motion.moves(r.hits.instance[i], r.hits.geometry[i]),
             in_group = at->grid.cluster_level > 0;
  if (among_movers) {
    const V3f P = r.rays.origin(i) + r.rays.direction(i) * r.hits.t[i];
    at->grid.span =
        motion.span_near(P, width, r.rays.time[i], shading_.settings.diffuse_rays.at(below.list_depth()) / 2);
  }
  if (in_group) shading_.patches->turn_group(hit.Ng, at->patch, &at->grid);
  const int entry =
      c.add_entry(RadiosityCache::key(at->grid.hash(), below.depth.diffuse), at->grid, below.depth.diffuse);
  if (!near_light && !among_movers && !in_group) c.set_answer(at->grid, slot, entry);
  return entry;
}

void CachedRadiosity::locate(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                             ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  CacheBatch& c = w.cache_level(place.level);
  const bool mirror = shading_.coats_mirror(below);
  int rays = 0;
  for (int set = 0; set < sets; ++set) rays += b.ray_set(set).count;
  c.clear(rays);
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) {
      scene::GridPoint& at = c.point[c.count];
      scene::PatchTable::PatchHit hit;
      float width;
      if (!wanted(r, i) || !dice_hit(b, below, r, i, growth, &hit, &width, &at, w)) continue;
      if (!is_read_enough(below, r, i, at.grid, w)) continue;
      const int entry = c.entry_of[c.count] = entry_at(below, r, i, hit, width, &at, c, w);
      c.entry[entry].needed |= 1u << (c.nearest[c.count] = uint8_t(shading_.patches->nearest(at)));
      const uint32_t geometry = r.hits.geometry[i];
      c.leaving[c.count] = 1;
      if (mirror && shading_.materials.has_coat(geometry))
        c.leaving[c.count] = scattering::through_coat(
            shading_.materials.coat(geometry),
            dot(shading_.scene.traced.surface_without_tangents(r.rays, r.hits, i).Ns, r.rays.direction(i)));
      c.set[c.count] = uint8_t(set);
      c.ray[c.count++] = i;
    }
  }
}

void CachedRadiosity::find_or_fill(const Place& below, CacheBatch& c, ShadingWorkspace& w) const {
  RadiosityCache& cache = *this->cache(below.arrival);
  RadiosityCache::Counts& counts = this->counts(below.arrival, w);
  ClaimGuard guard(cache, c);
  // Threads wait only for entries that are deeper by diffuse bounces than what they fill themselves: no ring; those of
  // irradiance are filled for what is seen alone. What others have filled meanwhile may lack points still.
  bool all_known = false;
  for (int round = 0; !all_known; ++round) {
    int first = 0, claimed = 0;
    for (int e = 0; e < c.entry_count; ++e) {
      RadiosityCache::Entry& entry = c.entry[e];
      if (e + looked_ahead < c.entry_count) cache.prefetch(c.entry[e + looked_ahead]);
      if (round > 0 && entry.found != TileCache::Found::pending) continue;
      cache.find(entry, &counts);
      if (round == most_waits && entry.found == TileCache::Found::pending) entry.found = TileCache::Found::refused;
      const int missing = std::popcount(c.to_fill(e));
      if (claimed + missing > most_claimed) {
        fill(below, first, e, c, w);
        guard.publish(first, e);
        first = e, claimed = 0;
      }
      claimed += missing;
    }
    fill(below, first, c.entry_count, c, w);
    guard.publish(first, c.entry_count);
    all_known = true;
    for (int e = 0; e < c.entry_count; ++e)
      if (c.entry[e].found == TileCache::Found::pending) all_known &= cache.wait(c.entry[e]);
  }
}

void CachedRadiosity::add(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                          ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  CacheBatch& c = w.cache_level(place.level);
  locate(place, below, growth, wanted, sets, w);
  find_or_fill(below, c, w);
  count_uses(below, c, w);

  for (int n = 0; n < c.count; ++n) {
    RaySet& r = b.ray_set(c.set[n]);
    const int i = c.ray[n];
    const RadiosityCache::Entry& entry = c.entry[c.entry_of[n]];
    r.cached[i] = entry.links().serves(c.point[n], c.nearest[n]);
    if (r.cached[i]) entry.add_to(r.L, i, c.nearest[n], c.leaving[n]);
  }
}

void CachedRadiosity::count_uses(const Place& below, const CacheBatch& c, ShadingWorkspace& w) {
  using Outcome = RadiosityCache::Entry::Outcome;
  const bool log = w.cache_log && below.arrival == Arrival::diffuse && below.depth.diffuse == 1;
  const double now = log ? w.cache_log->now() : 0;
  for (int e = 0; e < c.entry_count; ++e) {
    const RadiosityCache::Entry& entry = c.entry[e];
    const bool filled = entry.outcome == Outcome::filled;
    const bool extended = entry.outcome == Outcome::extended;
    counts(below.arrival, w).add(entry, {.lookups = 1, .hits = !filled, .fills = filled, .extensions = extended});
    if (log) w.cache_log->add(entry.key, filled, now);
  }
}

// Computes the points that are missing of entries [begin, end), but for those that another thread computes.
void CachedRadiosity::fill(const Place& below, int begin, int end, CacheBatch& c, ShadingWorkspace& w) const {
  PointBatch& f = w.level(below.level);
  const Timer timer;
  const double deeper = w.fill_seconds;  // grows by what fills of deeper bounces take
  const auto width_scale = [&](int share) { return 1 + growth(below, share) * group_width(); };
  int points[resolution_count] = {}, all = 0;
  link_tiles(begin, end, c, w);
  f.count = 0;
  for (int e = begin; e < end; ++e) {
    RadiosityCache::Entry& entry = c.entry[e];
    const uint32_t missing = c.to_fill(e);
    if (missing == 0) continue;
    const scene::GridId& id = entry.grid;
    const scene::PatchTable::Cell cell = shading_.patches->cell(id, &w.extents);
    for (int j = 0; j < id.height(); ++j)
      for (int i = 0; i < id.width(); ++i) {
        const int point = id.index(i, j);
        if (!(missing >> point & 1)) continue;
        if (shading_.patches->is_outside(id, i, j)) {  // rounding at the diagonal of a half
          entry.set_black(point);
          continue;
        }
        const int k = f.count++;
        placer_.place_cached_cell(id, i, j, cell, entry.key,
                                  below.arrival == Arrival::diffuse ? entry.diffuse_depth : 0, entry.links(),
                                  &w.extents, f, k);
        f.width[k] *= width_scale(f.diffuse_share(k)) / width_scale(1);
        c.target_entry[k] = e;
        c.target_point[k] = point;
        ++points[size_t(RadiosityCache::resolution(id))], ++all;
        if (f.count == PointBatch::capacity) fill_batch(below, c, w);
      }
  }
  if (f.count > 0) fill_batch(below, c, w);
  if (all == 0) return;
  const double seconds = timer.seconds() - (w.fill_seconds - deeper);
  w.fill_seconds += seconds;
  RadiosityCache::Counts& counts = this->counts(below.arrival, w);
  for (int r = 0; r < resolution_count; ++r) counts.by_resolution[r].fill_seconds += seconds * points[r] / all;
  counts.by_depth[size_t(below.depth.diffuse)].fill_seconds += seconds;
}

void CachedRadiosity::link_tiles(int begin, int end, CacheBatch& c, ShadingWorkspace& w) const {
  using Outcome = RadiosityCache::Entry::Outcome;
  w.linking.job_count = 0;
  for (int e = begin; e < end; ++e) {
    RadiosityCache::Entry& entry = c.entry[e];
    const uint32_t missing = c.to_fill(e);
    if (missing == 0) continue;
    entry.outcome = entry.known() ? Outcome::extended : Outcome::filled;
    c.links[e] = entry.known() ? entry.links() : TileLinks();
    w.linking.jobs[w.linking.job_count++] = {entry.grid, &c.links[e], missing, entry.known()};
  }
  if (w.linking.job_count == 0) return;
  shading_.link(w);
  for (int e = begin; e < end; ++e)
    if (c.to_fill(e) != 0) c.entry[e].set_links(c.links[e]);
}

void CachedRadiosity::fill_batch(const Place& below, CacheBatch& c, ShadingWorkspace& w) const {
  PointBatch& f = w.level(below.level);
  if (below.arrival == Arrival::diffuse) {
    // Of leaves, those inside of a crown would leave all to the outer ones.
    bool of_patch[PointBatch::capacity];
    for (int k = 0; k < f.count; ++k) of_patch[k] = c.entry[c.target_entry[k]].grid.cluster_level == 0;
    open_origins_.keep(f, of_patch, w);
  }
  shader_.shade_diffuse(below, w);
  for (int k = 0; k < f.count; ++k) c.entry[c.target_entry[k]].set(c.target_point[k], f.diffuse.at(k));
  f.count = 0;
}

}  // namespace dapple::distribution
