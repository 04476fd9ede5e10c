// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/hit_shader.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "dapple/distribution/cache_numbers.h"
#include "dapple/distribution/custom_stages.h"
#include "dapple/integrate/ray_origin.h"

namespace dapple::distribution {

using gi::RadiosityCache;
using integrate::Depth;
using integrate::LightSums;
using integrate::MaterialTable;
using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RaySet;
using scattering::Bsdf;
using scattering::BsdfKind;
using scattering::Lobe;
using shading::Stage;

namespace {

bool is_diffuse_ray(const RaySet& r, int ray) {
  return r.lobe[ray] == Lobe::diffuse;
}
bool is_specular_ray(const RaySet& r, int ray) {
  return !is_diffuse_ray(r, ray);
}

bool scatters(const Bsdf& b) {
  return !(b.reflectance.is_black() && b.transmittance.is_black());
}

// As DiffuseRays::chance, of a ray by all lobes.
float going_on(const Place& place, const PointBatch& b, int k, const RGB& weight) {
  // Rays by coats alone have been thinned already (HitGatherer).
  if (place.arrival == Arrival::coat || !place.ends_by_chance() || !b.stands_for_cone(k)) return 1;
  return std::min(1.0f, b.throughput[k] * weight.luminance());
}

// The boundary of a subsurface body as a probe sees it.
void open_boundary(Bsdf* b) {
  const Frame frame = b->frame;
  *b = b->kind == BsdfKind::subsurface ? Bsdf::make_entering(*b) : Bsdf::make_diffuse(RGB(1));
  b->frame = frame;
}

}  // namespace

HitShader::HitShader(const ShadingScene& shading, const PointPlacer& placer, RadiosityCache* radiosity,
                     RadiosityCache* irradiance)
    : shading_(shading),
      diffuse_rays_(shading, radiosity != nullptr),
      cached_(shading, placer, *this, radiosity, irradiance),
      gatherer_(shading, cached_, *this),
      media_(shading, cached_, gatherer_),
      subsurface_(shading, gatherer_) {}

void HitShader::shade_diffuse(const Place& place, ShadingWorkspace& w) const {
  prelight(place, w);
  light_diffuse(place, w);
}

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
  shading_.find_media(b, w);
  static_assert(MaterialTable::Scratch::most_points >= PointBatch::capacity);
  shading_.materials.prelight(
      b.count, b.geometry, b.surface,
      [&b](int k, pattern::ShadingPoints* points, int lane) { b.describe(k, points, lane); }, b.bsdf, w.prelighting,
      &w.stages, place.arrival == Arrival::diffuse ? MaterialTable::For::diffuse_rays : MaterialTable::For::viewers);
  const bool mirror = shading_.coats_mirror(place);
  for (int k = 0; k < b.count; ++k) {
    // Rays went straight through, or stopped, before: what stopped is scattered.
    if (place.level > 0 && b.bsdf[k].kind == BsdfKind::thin_dielectric && shading_.materials.is_sheet(b.geometry[k]))
      b.bsdf[k].reflects_only = true;
    if (place.arrival == Arrival::probe) open_boundary(&b.bsdf[k]);
    if (place.arrival == Arrival::coat) b.bsdf[k].keep_coat(b.wo[k]);
    if (mirror && shading_.materials.has_coat(b.geometry[k])) b.bsdf[k].remove_coat();
  }
}

void HitShader::light_diffuse(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  bool scattering[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k) {
    for (LightSums* sums : {&b.irradiance, &b.irradiance_behind, &b.diffuse}) sums->clear(k);
    scattering[k] = b.bsdf[k].is_diffuse() && scatters(b.bsdf[k]);
    const bool sends = scattering[k] && place.depth.diffuse < shading_.settings.bounces;
    b.seekers[k] = !sends                ? 0
                   : b.knows_indirect(k) ? shading_.direct.looking_rays(b, k, place.list_depth())
                                         : shading_.settings.diffuse_ray_count(place, b, k);
  }
  shading_.direct.light(b, place.list_depth(), scattering, w);
  if (place.depth.diffuse < shading_.settings.bounces) send_diffuse_rays(place, scattering, w);
  b.some_indirect_known = false;
  for (int k = 0; k < b.count; ++k) {
    if (!b.bsdf[k].is_diffuse()) continue;
    b.diffuse.set(k, b.irradiance, b.irradiance_behind, [&bsdf = b.bsdf[k]](const RGB& E, const RGB& behind) {
      return shading::lambertian_radiance(bsdf, E, behind);
    });
    ++w.stages[Stage::diffuselighting];
  }
  if (place.arrival == Arrival::probe) return;
  if (place.arrival == Arrival::view) subsurface_.light(place, w);
  run_diffuselighting(shading_.scene, b, w);
}

void HitShader::send_diffuse_rays(const Place& place, const bool* scattering, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  int sets = 0;
  // Those that bring all light, then those that only look for lights.
  for (const bool known : {false, true}) {
    const auto send = [&](bool last) {
      if (w.job_count > 0) diffuse_rays_.draw(place, b.ray_set(sets++), w);
      if (sets < PointBatch::most_ray_sets && !(last && sets > 0)) return;
      const int full = std::exchange(sets, 0);
      known ? gatherer_.look(place, full, w) : gatherer_.gather(place, full, w);
      add_light(b, full);
    };
    w.job_count = 0;
    for (int k = 0; k < b.count; ++k) {
      if (!scattering[k] || b.knows_indirect(k) != known) continue;
      if (known) b.irradiance.add(k, b.indirect.at(k));
      DiffuseRays::add_jobs(place, b, k, b.seekers[k], b.seekers[k], w, [&] { send(false); });
    }
    send(true);
  }
}

void HitShader::add_light(PointBatch& b, int sets) {
  // In the order of the rays, whoever answered them: sums must not depend on what the cache held.
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) (r.behind[i] ? b.irradiance_behind : b.irradiance).add(r.point[i], r.L.at(i));
  }
}

// Glass that disperses light sends one channel, at one wavelength, unless whoever sees it has chosen already. Returns
// what to multiply its light by.
RGB HitShader::disperse(PointBatch& b, int k) {
  if (!(b.bsdf[k].dispersion > 0)) return RGB(1);
  RGB weight(1);
  if (b.wavelength[k] == 0) {
    const int channel = std::min(int(3 * to_unit_float(random_of(b.key[k], Purpose::wavelengths, 0))), 2);
    b.wavelength[k] = scattering::wavelength_of(channel, to_unit_float(random_of(b.key[k], Purpose::wavelengths, 1)));
    weight = RGB();
    weight[channel] = 3;
  }
  b.bsdf[k].disperse(b.wavelength[k]);
  return weight;
}

void HitShader::light_specular(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  RGB dispersed[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k) dispersed[k] = disperse(b, k);
  for (int k = 0; k < b.count; ++k) {
    Bsdf& bsdf = b.bsdf[k];
    b.specular.clear(k);
    b.glint[k] = 0;
    bsdf.reflects_only |= bsdf.kind == BsdfKind::subsurface;  // what is inside has been diffused
    w.counts[k] = bsdf.is_diffuse()         ? 0
                  : bsdf.has_diffuse_base() ? shading_.settings.diffuse_ray_count(place, b, k)
                                            : 1;
    if (w.counts[k] > 0) ++w.stages[Stage::specularlighting];
  }
  int counts[PointBatch::capacity];  // w.counts belongs to the recursion once rays are traced
  std::copy_n(w.counts, b.count, counts);
  bool lit[PointBatch::capacity];
  for (int k = 0; k < b.count; ++k)
    lit[k] = counts[k] > 0 && (!b.bsdf[k].is_delta() || b.bsdf[k].is_coat()) && b.bsdf[k].kind != BsdfKind::passthrough;
  shading_.direct.light(b, place.list_depth(), lit, w);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k)
    for (int i = 0; i < counts[k]; ++i) {
      if (place.arrival == Arrival::coat && b.onward[k] == 0) continue;
      w.seed[w.job_count] = seed_of(b.sequence[k], Purpose::specular_rays);
      w.index[w.job_count] = b.number[k] * uint32_t(counts[k]) + uint32_t(i);
      w.job_weight[w.job_count] = 1 / float(counts[k]);
      w.job_point[w.job_count] = k;
      if (++w.job_count == w.capacity) send_specular_rays(place, w);
    }
  if (w.job_count > 0) send_specular_rays(place, w);
  for (int k = 0; k < b.count; ++k)
    if (dispersed[k] != RGB(1)) b.specular.scale(k, dispersed[k]);
}

void HitShader::draw_specular_rays(const Place& place, RaySet& r, ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  w.draw_samples(w.job_count);
  r.count = 0;
  for (int j = 0; j < w.job_count; ++j) {
    const int k = w.job_point[j];
    const Bsdf& bsdf = b.bsdf[k];
    scattering::BsdfSample s;
    if (bsdf.kind == BsdfKind::passthrough) {
      s = {-b.wo[k], RGB(1), 0, Lobe::passthrough, true, 1};
    } else if (!bsdf.sample(b.wo[k], w.u2[j], V2f(w.u0[j], w.u1[j]), random_of(b.key[k], Purpose::walks, w.index[j], 1),
                            &s)) {
      continue;
    }
    const float onward = place.arrival == Arrival::coat ? b.onward[k] : 1, chance = going_on(place, b, k, s.weight);
    if (chance < 1 && to_unit_float(random_of(b.key[k], Purpose::roulette, w.index[j])) >= chance) continue;
    const RGB weight = s.weight * (w.job_weight[j] * onward / chance);
    if (weight.is_black() || !weight.is_finite()) continue;
    const int i = r.count++;
    const uint32_t key = trace::ray_key(w.seed[j], w.index[j]);
    r.point[i] = k;
    r.sequence[i] = hash(b.sequence[k], w.seed[j]);
    r.number[i] = w.index[j];
    r.weight[i] = weight;
    r.pdf[i] = s.pdf / w.job_weight[j];
    r.origin[i] = RaySet::of_surface;
    r.throughput[i] = b.throughput[k] * std::min(1.0f, s.weight.luminance()) / chance;
    r.lobe[i] = s.lobe;
    r.cone[i] = std::max(
        b.spread[k], s.pdf > 0 ? std::min(CacheNumbers::widest_cone, 1 / std::sqrt(r.pdf[i] * float(b.share[k]))) : 0);
    r.share[i] = shared_by(b.share[k], int(std::lround(1 / w.job_weight[j])));
    r.spread[i] =
        s.lobe == Lobe::diffuse ? std::max(b.spread[k], GridNumbers::diffuse_spread) : widened(b.spread[k], onward);
    r.rays.set(i, offset_origin(b.surface[k], s.wi), s.wi, infinity, b.time[k], key, b.width[k], r.spread[i]);
    r.medium[i] = shading_.scene.bindings[b.geometry[k]].medium_beyond(s.wi, b.surface[k].Ng, b.medium[k]);
    r.wavelength[i] = b.wavelength[k];
    ++(s.lobe == Lobe::diffuse ? w.rays.diffuse : w.rays.specular);
  }
  w.job_count = 0;
}

void HitShader::send_specular_rays(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  RaySet& r = b.ray_set(0);
  draw_specular_rays(place, r, w);
  shading_.trace(r, w);
  shading_.direct.add_lights_hit(b, r, place.list_depth());
  const Depth d = place.depth;
  if (d.specular < shading_.settings.specular_depth) {
    const Place below{place.level + 1,
                      {d.diffuse, d.specular + 1},
                      place.arrival == Arrival::view ? Arrival::view : Arrival::diffuse};
    gatherer_.answer(place, below, 0, is_specular_ray, 1, w);
  }
  if (d.diffuse < shading_.settings.bounces)
    gatherer_.answer(place, place.behind_diffuse(), cached_.growth(place), is_diffuse_ray, 1, w);
  r.weigh();
  for (int i = 0; i < r.count; ++i) b.specular.add(r.point[i], r.L.at(i));
}

void HitShader::finish(PointBatch& b, Arrival arrival, ShadingWorkspace& w) const {
  for (int k = 0; k < b.count; ++k) {
    if (b.bsdf[k].kind == BsdfKind::subsurface || b.bsdf[k].removed_coat > 0)
      b.diffuse.scale(k, b.bsdf[k].crossing(dot(b.wo[k], b.bsdf[k].frame.n)));
    b.Ci.set(k, b.diffuse, b.specular, std::plus<>());
  }
  if (arrival == Arrival::view) run_view_stages(shading_.scene, b, w);
}

}  // namespace dapple::distribution
