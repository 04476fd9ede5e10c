// SPDX-License-Identifier: Apache-2.0
// The part of DistributionIntegrator that gives camera samples their light, when the shading points are there.
#include "dapple/distribution/distribution_workspace.h"
#include "dapple/integrate/describe.h"

namespace dapple::distribution {

using integrate::describe;
using integrate::LightSums;
using integrate::MaterialTable;
using integrate::PointBatch;
using scene::GridId;
using shading::Bsdf;

// Adds to the film what can be added; the other samples wait. Shades when that pays.
void DistributionIntegrator::finish_ready(DistributionWorkspace& w, scene::Film& film) const {
  w.finished = 0;
  for (int p = 0; p < w.camera.count; ++p) {
    const CameraSample& s = w.sample[p];
    if (s.is_ready() && !w.waiting.has_of(s.pixel)) {
      w.finishing_L[w.finished] = p;
      w.finishing[w.finished++] = &s;
      continue;
    }
    w.waiting.block(s.pixel);
    w.waiting.hits += s.source == Source::hit;
    const auto parts = w.L.parts(p);
    w.waiting.samples.push_back(
        {s, s.source == Source::grid ? w.held[s.held] : nullptr, w.L[p], {parts.begin(), parts.end()}});
  }
  finish_samples(w.L, w, film);
  if (w.waiting.samples.size() > WaitingSamples::most) {
    finish_waiting(w, film);
  } else if (w.claimed.count() >= PointBatch::capacity || w.waiting.hits >= DistributionWorkspace::capacity) {
    shade_claimed(PointBatch::capacity - 1, w);
    finish_some_waiting(w, film);
  }
}

// All of them. Points that other threads have claimed and not begun are shaded here: those threads may have run out of
// pixels.
void DistributionIntegrator::finish_waiting(DistributionWorkspace& w, scene::Film& film) const {
  shade_claimed(0, w);
  for (const auto& waiting : w.waiting.samples) {
    if (waiting.sample.source != Source::grid) continue;
    if (const ShadingGrid::Parts mine = waiting.grid->take(waiting.grid->unready(waiting.sample.wanted)))
      w.claimed.add(waiting.grid, mine, true);
  }
  shade_claimed(0, w);
  for (const auto& waiting : w.waiting.samples)
    if (waiting.sample.source == Source::grid) waiting.grid->wait(waiting.sample.wanted);
  finish_some_waiting(w, film);
}

// Those whose points are ready.
void DistributionIntegrator::finish_some_waiting(DistributionWorkspace& w, scene::Film& film) const {
  w.waiting.unblock_all();
  w.finished = 0;
  for (WaitingSamples::Waiting& waiting : w.waiting.samples) {
    const CameraSample& s = waiting.sample;
    if (w.waiting.has_of(s.pixel) || (s.source == Source::grid && !s.is_ready())) {
      w.waiting.block(s.pixel);
      continue;
    }
    w.waiting.hits -= s.source == Source::hit;
    const int k = w.finished++;
    w.finishing[k] = &s;
    w.finishing_L[k] = k;
    w.waiting_L.set(k, {waiting.L, waiting.parts.data()});
    waiting.done = true;
    if (w.finished < DistributionWorkspace::capacity) continue;
    finish_samples(w.waiting_L, w, film);
    w.finished = 0;
  }
  finish_samples(w.waiting_L, w, film);
  std::erase_if(w.waiting.samples, [](const auto& waiting) { return waiting.done; });
}

namespace {
void add_diffuse(const CameraSample& s, int k, LightSums& sums) {
  const ShadingGrid& grid = *s.grid;
  sums.clear(k);
  for (int c = 0; c < 4; ++c)
    if (s.near.weight[c] > 0)
      sums.add(k, RGB(s.near.weight[c]), {grid.diffuse[size_t(s.near.index[c])], grid.parts(s.near.index[c])});
}

void interpolate_bsdf(const CameraSample& s, Bsdf* bsdf) {
  const ShadingGrid& grid = *s.grid;
  if (!grid.bsdf) return;
  *bsdf = grid.bsdf[size_t(s.near.nearest)];
  V3f n(0, 0, 0);
  for (int c = 0; c < 4; ++c)
    if (s.near.weight[c] > 0) n += grid.bsdf[size_t(s.near.index[c])].frame.n * s.near.weight[c];
  if (length2(n) > 0) bsdf->frame = Frame(normalize(n), bsdf->frame.s);
}
}  // namespace

// Gives w.finishing its light, what depends on the view a camera sample at a time, and adds it to the film. L: what
// they have so far.
void DistributionIntegrator::finish_samples(LightSums& L, DistributionWorkspace& w, scene::Film& film) const {
  const bool wants_features = film.settings().features;
  const size_t groups = size_t(std::min(film.settings().light_groups, groups_));
  const MaterialTable& materials = shader_.materials();
  PointBatch& b = w.shading.level(sample_level);
  const HitShader::Place place{sample_level, {}, HitShader::Arrival::view};
  if (wants_features) std::fill_n(w.features, w.finished, scene::Features());
  for (const Source source : {Source::grid, Source::hit}) {
    b.count = 0;
    for (int i = 0; i < w.finished; ++i) {
      const CameraSample& s = *w.finishing[i];
      if (s.source != source) continue;
      if (source == Source::grid && !wants_features && materials.is_view_independent(s.geometry)) {
        add_diffuse(s, b.count, b.diffuse);
        L.add(w.finishing_L[i], s.passed, b.diffuse.at(b.count));
        continue;
      }
      const int k = b.count++;
      b.parent[k] = i;
      set_point(s, b, k);
      if (source == Source::grid) add_diffuse(s, k, b.diffuse);
    }
    if (b.count == 0) continue;
    if (source == Source::hit) {
      shader_.shade(place, w.shading);
    } else {
      materials.prelight_constant(b.count, b.geometry, b.surface, b.bsdf);
      for (int k = 0; k < b.count; ++k) interpolate_bsdf(*w.finishing[b.parent[k]], &b.bsdf[k]);
      shader_.light_specular(place, w.shading);
      shader_.finish(b, HitShader::Arrival::view, w.shading);
    }
    for (int k = 0; k < b.count; ++k) {
      const int i = b.parent[k];
      const CameraSample& s = *w.finishing[i];
      L.add(w.finishing_L[i], s.passed, b.Ci.at(k));
      if (!wants_features) continue;
      w.features[i] = describe(scene_, b.surface[k], b.bsdf[k], b.wo[k]);
      if (source == Source::grid) w.features[i].grid = describe_grid(s, &w.shading.extents);
    }
  }
  w.shading.tracing.stop.check();  // points that another thread gave up are published, too
  for (int i = 0; i < w.finished; ++i) {
    const CameraSample& s = *w.finishing[i];
    const int l = w.finishing_L[i];
    film.add(s.pixel.x, s.pixel.y, s.film_weight, L[l], w.features[i], L.parts(l).first(groups));
  }
}

// Writes point k: what a camera sample met.
void DistributionIntegrator::set_point(const CameraSample& s, PointBatch& b, int k) const {
  b.geometry[k] = s.geometry;
  b.surface[k] = s.surface;
  b.wo[k] = -s.d;
  b.set_one_time(k, s.time);
  b.width[k] = s.width;
  b.spread[k] = s.spread;
  b.medium[k] = s.medium;
  b.set_key(k, hash(settings_.shading.seed, s.seed, s.index), hash(settings_.shading.seed, s.seed), s.index);
  b.share[k] = sharing_samples();
  b.crowd[k] = b.effort[k] = 1;
  b.set_no_cell(k);
}

scene::GridFeatures DistributionIntegrator::describe_grid(const CameraSample& s,
                                                          scene::PatchTable::Extents* extents) const {
  const GridId& id = s.point.grid;
  scene::GridFeatures f;
  f.patch = id.patch;
  f.point = uint32_t(s.point.cell());
  f.level = id.cluster_level > 0 ? -2.0f * id.cluster_level : float(id.u_level + id.v_level);
  // Where the camera stands in the surface a pixel has no width; no image has more pixels than this.
  constexpr float most_pixels = 1 << 28;
  f.shading_rate = std::min(sqr(patches_.cell(id, extents).size / s.width), most_pixels);
  return f;
}

}  // namespace dapple::distribution
