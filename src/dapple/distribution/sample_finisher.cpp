// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/sample_finisher.h"

#include "dapple/integrate/describe.h"

namespace dapple::distribution {

using integrate::describe;
using integrate::LightSums;
using integrate::PointBatch;
using integrate::RayList;
using scattering::Bsdf;
using scene::GridId;

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

void SampleFinisher::add(CameraSamples& samples, std::span<const GridStore::GridPtr> held, Scratch& scratch,
                         ShadingWorkspace& w, scene::Film& film) const {
  scratch.count = 0;
  for (int p = 0; p < samples.count(); ++p) {
    const CameraSample& s = samples.sample[p];
    if (s.is_ready() && !scratch.waiting.has_of(s.pixel)) {
      scratch.sample_L[scratch.count] = p;
      scratch.sample[scratch.count++] = &s;
      continue;
    }
    scratch.waiting.block(s.pixel);
    scratch.waiting.hits += s.source == Source::hit;
    const auto parts = samples.L.parts(p);
    scratch.waiting.samples.push_back(
        {s, s.source == Source::grid ? held[s.held] : nullptr, samples.L[p], {parts.begin(), parts.end()}});
  }
  finish(samples.L, scratch, w, film);
}

void SampleFinisher::finish_waiting(Scratch& scratch, ShadingWorkspace& w, scene::Film& film) const {
  scratch.waiting.unblock_all();
  scratch.count = 0;
  for (WaitingSamples::Waiting& waiting : scratch.waiting.samples) {
    const CameraSample& s = waiting.sample;
    if (scratch.waiting.has_of(s.pixel) || (s.source == Source::grid && !s.is_ready())) {
      scratch.waiting.block(s.pixel);
      continue;
    }
    scratch.waiting.hits -= s.source == Source::hit;
    const int k = scratch.count++;
    scratch.sample[k] = &s;
    scratch.sample_L[k] = k;
    scratch.waiting_L.set(k, {waiting.L, waiting.parts.data()});
    waiting.done = true;
    if (scratch.count < Scratch::capacity) continue;
    finish(scratch.waiting_L, scratch, w, film);
    scratch.count = 0;
  }
  finish(scratch.waiting_L, scratch, w, film);
  std::erase_if(scratch.waiting.samples, [](const auto& waiting) { return waiting.done; });
}

// Finishes scratch.sample. L: the light that they have so far.
void SampleFinisher::finish(LightSums& L, Scratch& scratch, ShadingWorkspace& w, scene::Film& film) const {
  const bool wants_features = film.settings().features;
  const size_t groups = size_t(std::min(film.settings().light_groups, groups_));
  PointBatch& b = w.level(sample_level);
  for (int i = 0; wants_features && i < scratch.count; ++i)
    scratch.features[i] = scratch.sample[i]->source == Source::path ? scratch.sample[i]->features : scene::Features();
  for (const Source source : {Source::grid, Source::hit}) {
    b.count = 0;
    for (int i = 0; i < scratch.count; ++i) {
      const CameraSample& s = *scratch.sample[i];
      if (s.source != source) continue;
      if (source == Source::grid && !wants_features && shading_.materials.is_view_independent(s.geometry)) {
        add_diffuse(s, b.count, b.diffuse);
        L.add(scratch.sample_L[i], s.passed, b.diffuse.at(b.count));
        continue;
      }
      const int k = b.count++;
      b.parent[k] = i;
      set_point(s, b, k);
      if (source == Source::grid) add_diffuse(s, k, b.diffuse);
    }
    if (b.count == 0) continue;
    shade(source, w, scratch);
    for (int k = 0; k < b.count; ++k) {
      const int i = b.parent[k];
      const CameraSample& s = *scratch.sample[i];
      L.add(scratch.sample_L[i], s.passed, b.Ci.at(k));
      if (!wants_features) continue;
      scratch.features[i] = describe(shading_.scene, b.surface[k]);
      if (source == Source::grid) scratch.features[i].grid = describe_grid(s, &w.extents);
    }
  }
  w.tracing.stop.check();  // points that another thread gave up are published, too
  for (int i = 0; i < scratch.count; ++i) {
    const CameraSample& s = *scratch.sample[i];
    const int l = scratch.sample_L[i];
    film.add(s.pixel.x, s.pixel.y, s.film_weight, L[l], scratch.features[i], L.parts(l).first(groups),
             s.source == Source::path ? s.direct : RGB());
  }
}

void SampleFinisher::shade(Source source, ShadingWorkspace& w, const Scratch& scratch) const {
  const Place place{sample_level, {}, Arrival::view};
  PointBatch& b = w.level(sample_level);
  if (source == Source::hit) {
    shader_.shade(place, w);
  } else {
    shading_.materials.prelight_constant(b.count, b.geometry, b.surface, b.bsdf);
    for (int k = 0; k < b.count; ++k) interpolate_bsdf(*scratch.sample[b.parent[k]], &b.bsdf[k]);
    shader_.light_specular(place, w);
    shader_.finish(b, Arrival::view, w);
  }
}

void SampleFinisher::set_point(const CameraSample& s, PointBatch& b, int k) const {
  b.geometry[k] = s.geometry;
  b.surface[k] = s.surface;
  b.wo[k] = -s.d;
  b.set_one_time(k, s.time);
  b.width[k] = s.width;
  b.spread[k] = s.spread;
  b.medium[k] = s.medium;
  b.wavelength[k] = 0;
  b.set_key(k, hash(settings_.shading.seed, s.seed, s.index), hash(settings_.shading.seed, s.seed), s.index);
  b.share[k] = settings_.sharing_samples();
  b.crowd[k] = settings_.visible_points == VisiblePoints::samples
                   ? RayList::part(settings_.shading.diffuse_rays.at(0), b.share[k])
                   : 1;
  b.effort[k] = 1;
  b.throughput[k] = 1;
  b.set_no_cell(k);
}

scene::GridFeatures SampleFinisher::describe_grid(const CameraSample& s, scene::PatchTable::Extents* extents) const {
  const GridId& id = s.point.grid;
  scene::GridFeatures f;
  f.patch = id.patch;
  f.point = uint32_t(s.point.cell());
  f.level = id.cluster_level > 0 ? -2.0f * id.cluster_level : float(id.u_level + id.v_level);
  // Where the camera stands in the surface a pixel has no width; no image has more pixels than this.
  constexpr float most_pixels = 1 << 28;
  f.shading_rate = std::min(sqr(shading_.patches->cell(id, extents).size / s.width), most_pixels);
  return f;
}

}  // namespace dapple::distribution
