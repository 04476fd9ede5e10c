// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/hit_shader.h"

#include <functional>
#include <utility>

#include "dapple/distribution/custom_stages.h"
#include "dapple/integrate/ray_origin.h"

namespace dapple::distribution {

using gi::RadiosityCache;
using integrate::Depth;
using integrate::LightSums;
using integrate::MaterialTable;
using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RayOrigin;
using integrate::RaySet;
using integrate::RayTracer;
using light::SurfaceMedia;
using shading::Bsdf;
using shading::BsdfKind;
using shading::Lobe;
using shading::Stage;
using trace::no_id;
using trace::RayBatch;

namespace {

// Cells are wider than those that ask for them by so many times the cache's width: else a chain of short rays, in a
// corner or between the legs of chairs, asks for ever more fine cells, bounce by bounce. What is seen is fine, and of
// cells with few rays, as those of leaves, noise hides how coarse they are.
constexpr float least_growth = 1, most_growth = 3, growth_of_one_ray = 12;
constexpr float largest_cell = 32;  // common ones
constexpr float least_coats =
    0.3f;  // of those that are met, at least such a share is looked at: fewer find lamps by chance
constexpr int64_t most_shares = 1 << 16;  // more than any list of rays has

// PointBatch::share of what one of `rays` from such a point meets.
int shared_by(int share, int rays) {
  return int(std::min(int64_t(share) * rays, most_shares));
}

// By cells of their square of random numbers, in Z order: neighbours go in similar directions.
constexpr int cells_each_way = 8, cell_count = cells_each_way * cells_each_way;
int cell_of(float u, float v) {
  constexpr uint8_t spread[cells_each_way] = {0, 1, 4, 5, 16, 17, 20, 21};
  const auto along = [](float x) { return std::min(int(x * cells_each_way), cells_each_way - 1); };
  return spread[along(u)] | spread[along(v)] << 1;
}

// The jobs [first, end), those of similar directions beside each other.
void order_by_direction(const ShadingWorkspace& w, int first, int end, int* order) {
  int start[cell_count + 1] = {};
  uint8_t cell[ShadingWorkspace::capacity];
  for (int j = first; j < end; ++j) ++start[1 + (cell[j] = uint8_t(cell_of(w.u0[j], w.u1[j])))];
  for (int c = 0; c < cell_count; ++c) start[c + 1] += start[c];
  for (int j = first; j < end; ++j) order[start[cell[j]]++] = j;
}

bool scatters(const Bsdf& b) {
  return !(b.reflectance.is_black() && b.transmittance.is_black());
}

// The boundary of a subsurface body as a probe sees it.
void open_boundary(Bsdf* b) {
  const Frame frame = b->frame;
  *b = b->kind == BsdfKind::subsurface ? Bsdf::make_entering(*b) : Bsdf::make_diffuse(RGB(1));
  b->frame = frame;
}

}  // namespace

HitShader::HitShader(const scene::Scene& scene, const Settings& settings, const scene::PatchTable* patches,
                     RadiosityCache* cache, RadiosityCache* irradiance)
    : scene_(scene),
      patches_(patches),
      cache_(cache),
      irradiance_cache_(irradiance),
      settings_(settings),
      materials_(scene, settings.caustics),
      tracer_(scene, materials_, true, settings.visibility),
      direct_(scene, tracer_, settings.shadow_rays),
      surface_media_(scene),
      linker_(scene, materials_, patches),
      common_area_(common_area(scene)),
      widest_cell_(std::sqrt(largest_cell * common_area_)) {}

void HitShader::shade(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  prelight(place, w);
  if (place.arrival == Arrival::coat) {
    for (int k = 0; k < b.count; ++k) b.diffuse.clear(k);
  } else {
    light_diffuse(place, w);
  }
  light_specular(place, w);
  finish(b, place.arrival, w);
}

void HitShader::prelight(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  find_media(b, w);
  static_assert(MaterialTable::Scratch::most_points >= PointBatch::capacity);
  materials_.prelight(
      b.count, b.geometry, b.surface,
      [&b](int k, shading::ShadingPoints* points, int lane) { b.describe(k, points, lane); }, b.bsdf, w.prelighting,
      &w.stages, place.arrival == Arrival::diffuse ? MaterialTable::For::diffuse_rays : MaterialTable::For::viewers);
  const bool mirror = coats_mirror(place);
  for (int k = 0; k < b.count; ++k) {
    // Rays went straight through, or stopped, before: what stopped is scattered.
    if (place.level > 0 && b.bsdf[k].kind == BsdfKind::thin_dielectric && materials_.is_sheet(b.geometry[k]))
      b.bsdf[k].reflects_only = true;
    if (place.arrival == Arrival::probe) open_boundary(&b.bsdf[k]);
    if (place.arrival == Arrival::coat) b.bsdf[k].keep_coat(b.wo[k]);
    if (mirror && materials_.has_coat(b.geometry[k])) b.bsdf[k].remove_coat();
  }
}

void HitShader::find_media(PointBatch& b, ShadingWorkspace& w) const {
  if (!surface_media_.vary()) return;
  if (!w.surface_media) w.surface_media = std::make_unique<SurfaceMedia::Scratch>();
  const Timer timer;
  surface_media_.find(b, *w.surface_media);
  w.stages.tracing_seconds += timer.seconds();
}

void HitShader::link(ShadingWorkspace& w) const {
  const Timer timer;
  w.rays.link += linker_.link(w.linking);
  w.stages.tracing_seconds += timer.seconds();
}

void HitShader::light_diffuse(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  bool scattering[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k) {
    for (LightSums* sums : {&b.irradiance, &b.irradiance_behind, &b.diffuse}) sums->clear(k);
    scattering[k] = b.bsdf[k].is_diffuse() && scatters(b.bsdf[k]);
  }
  direct_.light(b, list_depth(place), scattering, w);
  if (place.depth.diffuse < settings_.bounces) {
    int sets = 0;
    const auto send = [&](bool last) {
      if (w.job_count > 0) draw_diffuse_rays(place, b.ray_set(sets++), w);
      if (sets == PointBatch::most_ray_sets || (last && sets > 0)) light_indirectly(place, std::exchange(sets, 0), w);
    };
    w.job_count = 0;
    for (int k = 0; k < b.count; ++k) {
      if (!scattering[k]) continue;
      if (b.some_indirect_known && b.indirect_known[k]) {
        b.irradiance.add(k, b.indirect.at(k));
        continue;
      }
      const int rays = diffuse_rays(place, b, k);
      add_diffuse_jobs(b, k, rays, rays, w, [&] { send(false); });
    }
    send(true);
  }
  b.some_indirect_known = false;
  for (int k = 0; k < b.count; ++k) {
    if (!b.bsdf[k].is_diffuse()) continue;
    b.diffuse.set(k, b.irradiance, b.irradiance_behind, [&bsdf = b.bsdf[k]](const RGB& E, const RGB& behind) {
      return shading::lambertian_radiance(bsdf, E, behind);
    });
    ++w.stages[Stage::diffuselighting];
  }
  if (place.arrival == Arrival::probe) return;
  if (place.arrival == Arrival::view) light_subsurface(place, w);
  run_diffuselighting(scene_, b, w);
}

// Nearest hits of a set of rays, what media on the way glow, and where rays ended in these; weights lose what is lost
// on the way.
void HitShader::trace_rays(RaySet& r, ShadingWorkspace& w) const {
  if (scene_.has_media() && !r.flights) r.flights = std::make_unique<RayTracer::Flights>();
  const Timer timer;
  tracer_.nearest(r.rays, r.count, r.medium, &r.hits, r.distance, w.passed, w.tracing, r.flights.get(), r.sheets);
  w.stages.tracing_seconds += timer.seconds();
  w.stages += std::exchange(w.tracing.stages, {});
  for (int i = 0; i < r.count; ++i) r.glow[i] = r.flights ? r.weight[i] * r.flights->emitted[i] : RGB();
  if (!tracer_.weakens()) return;
  for (int i = 0; i < r.count; ++i) r.weight[i] *= w.passed[i];
}

void HitShader::light_indirectly(const Place& place, int sets, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  gather(place, sets, w);
  // In the order of the rays, whoever answered them: sums must not depend on what the cache held.
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) (r.behind[i] ? b.irradiance_behind : b.irradiance).add(r.point[i], r.L.at(i));
  }
}

void HitShader::draw_diffuse_rays(const Place& place, RaySet& r, ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  w.draw_samples(w.job_count);
  alignas(64) float x[ShadingWorkspace::capacity], y[ShadingWorkspace::capacity], z[ShadingWorkspace::capacity];
  for (int j = 0; j < w.job_count; ++j) {
    const V3f local = square_to_cosine_hemisphere(V2f(w.u0[j], w.u1[j]));
    x[j] = local.x, y[j] = local.y, z[j] = local.z;
  }
  r.count = 0;
  for (int first = 0, end = 0; first < w.job_count; first = end) {
    const int k = w.job_point[first];
    while (end < w.job_count && w.job_point[end] == k) ++end;
    const Bsdf& bsdf = b.bsdf[k];
    const float reflected = bsdf.reflectance.luminance(), both = reflected + bsdf.transmittance.luminance();
    const float front = both > 0 ? reflected / both : bsdf.reflectance.is_black() ? 0.0f : 1.0f;
    const float weight = pi * w.job_weight[first], weights[2] = {weight / front, weight / (1 - front)};
    const bool seen_from_behind = bsdf.side(b.wo[k]) < 0, one_origin = b.has_one_origin(k);
    const DiffuseFan fan = diffuse_fan(b, k, diffuse_rays(place, b, k));
    RayOrigin from = b.origin_of(k, int(w.index[first]), w.seed[first]);
    const bool joins = RayBatch::pays_to_join(end - first);
    int order[ShadingWorkspace::capacity];
    if (joins) order_by_direction(w, first, end, order);
    for (int n = 0, in_packet = 0; n < end - first; ++n) {
      if (n % RayBatch::packet == 0) in_packet = 0;
      const int j = joins ? order[n] : first + n;
      const bool behind = w.u2[j] >= front;
      const float cosine = z[j];
      if (cosine <= 0) continue;
      const V3f local(x[j], y[j], seen_from_behind != behind ? -cosine : cosine);
      if (!one_origin) from = b.origin_of(k, int(w.index[j]), w.seed[j]);
      const V3f d =
          from.turn == V3f(0, 0, 0) ? bsdf.frame.to_world(local) : Frame(from.normal(bsdf.frame.n)).to_world(local);
      float passed = 1;
      if (bsdf.bent) {
        const V3f normal = from.normal(bsdf.frame.n);
        passed = bsdf.terminator(d, normal, dot(normal, from.Ng) < 0 ? -from.Ng : from.Ng);
        if (!(passed > 0)) continue;
      }
      const int i = r.count++;
      set_diffuse_ray(b, fan, r, i, from, d, cosine, trace::ray_key(w.seed[j], w.index[j]));
      r.rays.joined[i] = joins && in_packet++ > 0;
      r.behind[i] = behind;
      r.weight[i] = bsdf.crossing(cosine) * (passed * weights[behind]);
    }
  }
  w.job_count = 0;
}

// Each ray brings as much light as the others: what it finds is no more blurred at glancing angles. Without the cache
// it is the lists that say how many. What the cache does not serve is one of many that a point of it, or a pixel, sees.
HitShader::DiffuseFan HitShader::diffuse_fan(const PointBatch& b, int k, int rays) const {
  const float solid_angle = pi / float(rays);
  return {k, solid_angle, std::max(b.spread[k], std::min(widest_spread, std::sqrt(solid_angle))),
          cache_ ? shared_by(b.diffuse_share(k), rays) : b.share[k]};
}

void HitShader::set_diffuse_ray(const PointBatch& b, const DiffuseFan& fan, RaySet& r, int i, const RayOrigin& from,
                                const V3f& d, float cosine, uint32_t key) const {
  const int k = fan.point;
  r.point[i] = k;
  r.sequence[i] = hash(b.key[k], key);
  r.number[i] = 0;
  r.weight[i] = RGB(1);
  r.cone[i] = std::min(widest_cone, std::sqrt(fan.solid_angle / cosine));
  r.spread[i] = fan.spread;
  r.rays.set(i, offset_origin(from, d), d, infinity, from.time, key, b.width[k], fan.spread);
  r.medium[i] = scene_.bindings[b.geometry[k]].medium_beyond(d, from.Ng, b.medium_of(k, from));
  r.share[i] = fan.share;
}

void HitShader::gather(const Place& place, int sets, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) {
    RaySet& r = b.ray_set(set);
    w.rays.diffuse += uint64_t(r.count);
    trace_rays(r, w);
    r.L.clear_all(r.count);
  }
  gather_hits(place, behind_diffuse(place), growth(place), any_ray, sets, w);
  for (int set = 0; set < sets; ++set) b.ray_set(set).weigh();
}

float HitShader::growth(const Place& place, int share) const {
  if (place.depth.diffuse == 0) return most_growth;
  return std::clamp(growth_of_one_ray / float(std::max(diffuse_rays(place, share), 1)), least_growth, most_growth);
}

HitShader::Place HitShader::behind_diffuse(const Place& place) {
  return {place.level + 1, {place.depth.diffuse + 1, place.depth.specular}, Arrival::diffuse};
}

void HitShader::gather_hits(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                            ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) {
    RaySet& r = b.ray_set(set);
    std::fill_n(r.cached, r.count, false);
    std::fill_n(r.glint, r.count, 0.0f);
  }
  if (cache_for(below.arrival))
    add_radiosity(place, {below.level, {below.depth.diffuse, 0}, below.arrival}, growth, wanted, sets, w);
  shade_hits(
      place, below, sets, [&](const RaySet& r, int i) { return !r.cached[i] && wanted(r, i) ? 1.0f : 0.0f; }, w);
  if (coats_mirror(below) && materials_.any_coat())
    shade_hits(
        place, {below.level, below.depth, Arrival::coat}, sets,
        [&](const RaySet& r, int i) {
          if (!wanted(r, i) || !materials_.has_coat(r.hits.geometry[i])) return 0.0f;
          return direct_.glints() ? 1 : coat_weight(b, r, i);  // all are lit, of which `onward` go on
        },
        w);
  if (!scene_.has_media()) return;
  for (int set = 0; set < sets; ++set) add_media(b.ray_set(set), below, wanted, w);
}

// One of so many rays goes on by the coat that it met, where it sees it at this angle: about as many as a coat mirrors.
float HitShader::coat_weight(const PointBatch& b, const RaySet& r, int i) const {
  const float cosine = dot(scene_.traced.surface_without_tangents(r.rays, r.hits, i).Ns, r.rays.direction(i));
  const float chance = std::max(shading::CommonCoat::reflectance(cosine), least_coats);
  return to_unit_float(hash(b.key[r.point[i]], for_coats, r.rays.key[i])) < chance ? 1 / chance : 0;
}

// In batches of all sets.
template <class Weight>
void HitShader::shade_hits(const Place& place, const Place& below, int sets, const Weight& weight,
                           ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  PointBatch& found = w.level(below.level);
  float weights[PointBatch::capacity];
  const auto shade_found = [&] {
    if (found.count > 0) shade(below, w);
    for (int c = 0; c < found.count; ++c) {
      RaySet& r = b.ray_set(found.parent[c] / RaySet::capacity);
      const int i = found.parent[c] % RaySet::capacity;
      r.L.add(i, RGB(weights[c]), found.Ci.at(c));
      r.glint[i] += weights[c] * found.glint[c];
    }
    found.count = 0;
  };
  found.count = 0;
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) {
      if (r.hits.geometry[i] == no_id) continue;
      const float taken = weight(r, i);
      if (taken == 0 || r.weight[i].is_black()) continue;
      const int k = r.point[i], c = found.count++;
      weights[c] = taken;
      found.parent[c] = set * RaySet::capacity + i;
      found.geometry[c] = r.hits.geometry[i];
      found.surface[c] = materials_.needs_tangents(r.hits.geometry[i])
                             ? scene_.traced.surface(r.hits, i, r.rays.time[i])
                             : scene_.traced.surface_without_tangents(r.rays, r.hits, i);
      found.wo[c] = -r.rays.direction(i);
      found.set_one_time(c, r.rays.time[i]);
      found.spread[c] = widened(r.spread[i], taken);
      found.width[c] = b.width[k] + found.spread[c] * r.distance[i];
      found.medium[c] = r.medium[i];
      const bool sheet = materials_.is_sheet(r.hits.geometry[i]);
      const uint64_t key = sheet ? RayTracer::sheet_key(r.rays.key[i], r.sheets[i]) : hash(b.key[k], r.rays.key[i]);
      found.set_key(c, key, r.sequence[i], r.number[i]);
      found.share[c] = std::max(1, int(float(r.share[i]) / taken));
      found.crowd[c] = found.effort[c] = 1;
      found.set_no_cell(c);
      found.onward[c] = below.arrival == Arrival::coat && direct_.glints() ? coat_weight(b, r, i) : 1;
      if (found.count == PointBatch::capacity) shade_found();
    }
  }
  shade_found();
}

void HitShader::light_specular(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int k = 0; k < b.count; ++k) {
    Bsdf& bsdf = b.bsdf[k];
    b.specular.clear(k);
    b.glint[k] = 0;
    bsdf.reflects_only |= bsdf.kind == BsdfKind::subsurface;  // what is inside has been diffused
    const bool layered = bsdf.kind == BsdfKind::coated && bsdf.base == BsdfKind::diffuse;
    w.counts[k] = bsdf.is_diffuse() ? 0 : layered ? diffuse_rays(place, b, k) : 1;
    if (w.counts[k] > 0) ++w.stages[Stage::specularlighting];
  }
  int counts[PointBatch::capacity];  // w.counts belongs to the recursion once rays are traced
  std::copy_n(w.counts, b.count, counts);
  bool lit[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k)
    lit[k] = counts[k] > 0 && (!b.bsdf[k].is_delta() || b.bsdf[k].is_coat()) && b.bsdf[k].kind != BsdfKind::passthrough;
  direct_.light(b, list_depth(place), lit, w);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k)
    for (int i = 0; i < counts[k]; ++i) {
      if (place.arrival == Arrival::coat && b.onward[k] == 0) continue;
      w.seed[w.job_count] = seed_of(b.sequence[k], for_specular_rays);
      w.index[w.job_count] = b.number[k] * uint32_t(counts[k]) + uint32_t(i);
      w.job_weight[w.job_count] = 1 / float(counts[k]);
      w.job_point[w.job_count] = k;
      if (++w.job_count == w.capacity) draw_specular_rays(place, w);
    }
  if (w.job_count > 0) draw_specular_rays(place, w);
}

void HitShader::draw_specular_rays(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  RaySet& r = b.ray_set(0);
  w.draw_samples(w.job_count);
  r.count = 0;
  for (int j = 0; j < w.job_count; ++j) {
    const int k = w.job_point[j];
    const Bsdf& bsdf = b.bsdf[k];
    shading::BsdfSample s;
    if (bsdf.kind == BsdfKind::passthrough) {
      s = {-b.wo[k], RGB(1), 0, Lobe::passthrough, true, 1};
    } else if (!bsdf.sample(b.wo[k], w.u2[j], V2f(w.u0[j], w.u1[j]), hash(b.key[k], for_walks, w.index[j], 1), &s)) {
      continue;
    }
    const float onward = place.arrival == Arrival::coat ? b.onward[k] : 1;
    const RGB weight = s.weight * (w.job_weight[j] * onward);
    if (weight.is_black() || !weight.is_finite()) continue;
    const int i = r.count++;
    const uint32_t key = trace::ray_key(w.seed[j], w.index[j]);
    r.point[i] = k;
    r.sequence[i] = hash(b.sequence[k], w.seed[j]);
    r.number[i] = w.index[j];
    r.weight[i] = weight;
    r.pdf[i] = s.pdf / w.job_weight[j];
    r.lobe[i] = s.lobe;
    r.cone[i] =
        std::max(b.spread[k], s.pdf > 0 ? std::min(widest_cone, 1 / std::sqrt(r.pdf[i] * float(b.share[k]))) : 0);
    r.share[i] = shared_by(b.share[k], int(std::lround(1 / w.job_weight[j])));
    r.spread[i] = s.lobe == Lobe::diffuse ? std::max(b.spread[k], 0.05f) : widened(b.spread[k], onward);
    r.rays.set(i, offset_origin(b.surface[k], s.wi), s.wi, infinity, b.time[k], key, b.width[k], r.spread[i]);
    r.medium[i] = scene_.bindings[b.geometry[k]].medium_beyond(s.wi, b.surface[k].Ng, b.medium[k]);
    ++(s.lobe == Lobe::diffuse ? w.rays.diffuse : w.rays.specular);
  }
  trace_rays(r, w);
  direct_.add_lights_hit(b, r, list_depth(place));
  const Depth d = place.depth;
  if (d.specular < settings_.specular_depth) {
    const Place below{place.level + 1,
                      {d.diffuse, d.specular + 1},
                      place.arrival == Arrival::coat ? Arrival::diffuse : place.arrival};
    gather_hits(place, below, 0, is_specular_ray, 1, w);
  }
  if (d.diffuse < settings_.bounces) gather_hits(place, behind_diffuse(place), growth(place), is_diffuse_ray, 1, w);
  r.weigh();
  for (int i = 0; i < r.count; ++i) b.specular.add(r.point[i], r.L.at(i));
  w.job_count = 0;
}

void HitShader::finish(PointBatch& b, Arrival arrival, ShadingWorkspace& w) const {
  for (int k = 0; k < b.count; ++k) {
    if (b.bsdf[k].kind == BsdfKind::subsurface || b.bsdf[k].removed_coat > 0)
      b.diffuse.scale(k, b.bsdf[k].crossing(dot(b.wo[k], b.bsdf[k].frame.n)));
    b.Ci.set(k, b.diffuse, b.specular, std::plus<>());
  }
  if (arrival == Arrival::view) run_view_stages(scene_, b, w);
}

}  // namespace dapple::distribution
