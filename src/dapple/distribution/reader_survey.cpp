// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/reader_survey.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dapple/base/parallel.h"
#include "dapple/base/pool.h"
#include "dapple/distribution/cache_numbers.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RaySet;
using scattering::Lobe;
using trace::no_id;

namespace {

constexpr uint64_t for_survey = 0x737572766579;  // of all that random numbers are for

constexpr int most_depths = 6;  // beyond, few rays are left

// One path for so many camera samples, within limits: some hundredths of the image's work. Paths of each depth are
// followed from the camera: half as many for each, so that all take about what the first two take.
uint32_t path_count(const V2i& film, int pixel_samples, int depth) {
  constexpr double least = 256, most = 16384, part = 1.0 / 64;
  const double first = std::clamp(double(film.x) * film.y * pixel_samples * part, least, most);
  return uint32_t(std::max(first * std::exp2(1 - depth), least));
}

}  // namespace

/// What a thread needs. `depth`: diffuse, at which paths end.
struct ReaderSurvey::Workspace : ShadingWorkspace {
  int depth = 1;
  CameraSamples camera{0};
  std::vector<ReaderMap::Reader> readers;
  std::vector<float> widths;    // of readers
  std::vector<ReadCell> cells;  // that they would read
  size_t ends = 0;              // of diffuse rays of this depth
  bool view_dependent = false;
};

ReaderSurvey::ReaderSurvey(const ShadingScene& shading, const PointPlacer& placer, const HitShader& shader,
                           const Hider& hider, const SampleFinisher& finisher, const DistributionSettings& settings)
    : shading_(shading),
      shader_(shader),
      hider_(hider),
      finisher_(finisher),
      settings_(settings),
      uncached_(shading, placer, *this, nullptr, nullptr),
      gatherer_(shading, uncached_, *this) {}

void ReaderSurvey::fill(SurveyedReaders* result) const {
  ReaderMap* const map = &result->map;
  const V2i film = shading_.scene.camera.settings().resolution;
  double answered = 0, ends = 0;  // rays
  Pool<Workspace> pool;
  while (map->depths() < std::min(settings_.shading.bounces, most_depths)) {
    const uint32_t paths = path_count(film, settings_.pixel_samples, map->depths() + 1),
                   batch = CameraSamples::capacity;
    const float rays_each = float(double(film.x) * film.y * settings_.pixel_samples / paths);
    std::vector<std::vector<ReaderMap::Reader>> found((paths + batch - 1) / batch);
    std::vector<std::vector<float>> widths(found.size());
    std::vector<std::vector<ReadCell>> cells(found.size());
    std::vector<size_t> ends_of(found.size());
    std::vector<char> view_dependent(found.size());
    parallel_for(found.size(), [&](size_t i) {
      settings_.stop.check();
      auto w = pool.take([] { return std::make_unique<Workspace>(); });
      w->depth = map->depths() + 1;
      w->ends = 0, w->view_dependent = false;
      const uint32_t first = uint32_t(i) * batch;
      trace_camera_rays(first, int(std::min(paths - first, batch)), *w);
      found[i] = std::exchange(w->readers, {}), widths[i] = std::exchange(w->widths, {});
      cells[i] = std::exchange(w->cells, {});
      ends_of[i] = w->ends;
      view_dependent[i] = w->view_dependent;
      pool.give(std::move(w));
    });
    std::vector<ReaderMap::Reader> all;
    std::vector<float> all_widths;
    for (size_t i = 0; i < found.size(); ++i) {
      all.insert(all.end(), found[i].begin(), found[i].end());
      all_widths.insert(all_widths.end(), widths[i].begin(), widths[i].end());
    }
    map->add_depth(all, all_widths, rays_each, shading_.most_readers(map->depths() + 1));
    for (size_t i = 0; i < found.size(); ++i) {
      ends += double(rays_each) * double(ends_of[i]);
      result->view_dependent |= view_dependent[i];
      for (size_t k = 0; k < found[i].size(); ++k) {
        const float widest = map->widest(found[i][k], map->depths());
        const ReadCell cell = cells[i][k].least_width > widest ? ReadCell::square(widest) : cells[i][k];
        if (cells[i][k].area > 0 && shading_.cell_effort(found[i][k], map->depths(), cell) > 0)
          answered += double(rays_each);
      }
    }
  }
  if (ends > 0) result->answered = float(answered / ends);
}

void ReaderSurvey::trace_camera_rays(uint32_t first, int count, Workspace& w) const {
  CameraSamples& s = w.camera;
  hider_.locate_spread(first, count, hash(settings_.shading.seed, for_survey), s, w);
  PointBatch& b = w.level(sample_level);
  b.count = 0;
  for (int p = 0; p < s.count(); ++p)
    if (s.sample[p].source != Source::nothing) finisher_.set_point(s.sample[p], b, b.count++);
  if (b.count > 0) shade({sample_level, {}, Arrival::view}, w);
}

void ReaderSurvey::shade_media(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  b.Ci.clear_all(b.count);
}

void ReaderSurvey::shade(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  b.Ci.clear_all(b.count);
  std::fill_n(b.glint, b.count, 0.0f);
  std::fill_n(b.seekers, b.count, 0);
  if (place.arrival == Arrival::coat) return;
  shader_.prelight(place, w);
  if (place.depth.diffuse < static_cast<Workspace&>(w).depth) send_diffuse_rays(place, w);
  if (place.depth.specular < settings_.shading.specular_depth) send_specular_rays(place, w);
}

void ReaderSurvey::send_diffuse_rays(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k)
    if (b.bsdf[k].is_diffuse() && !b.bsdf[k].albedo().is_black())
      DiffuseRays::add_jobs(place, b, k, 1, settings_.shading.diffuse_ray_count(place, b, k), w, [] {});
  if (w.job_count == 0) return;
  RaySet& r = b.ray_set(0);
  shader_.diffuse_rays().draw(place, r, w);
  std::fill_n(r.lobe, r.count, Lobe::diffuse);
  shading_.trace(r, w);
  r.L.clear_all(r.count);
  note_readers(place, HitGatherer::any_ray, static_cast<Workspace&>(w));
  gatherer_.answer(place, place.behind_diffuse(), 1, HitGatherer::any_ray, 1, w);
}

void ReaderSurvey::send_specular_rays(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k) {
    if (b.bsdf[k].is_diffuse() || b.bsdf[k].kind == scattering::BsdfKind::subsurface) continue;
    const int j = w.job_count++;
    w.seed[j] = seed_of(b.sequence[k], Purpose::specular_rays);
    w.index[j] = b.number[k];
    w.job_weight[j] = 1;
    w.job_point[j] = k;
  }
  if (w.job_count == 0) return;
  RaySet& r = b.ray_set(0);
  shader_.draw_specular_rays(place, r, w);
  shading_.trace(r, w);
  r.L.clear_all(r.count);
  constexpr auto is_diffuse = [](const RaySet& set, int i) { return set.lobe[i] == Lobe::diffuse; };
  constexpr auto is_specular = [](const RaySet& set, int i) { return set.lobe[i] != Lobe::diffuse; };
  gatherer_.answer(place, {place.level + 1, {place.depth.diffuse, place.depth.specular + 1}, place.arrival}, 1,
                   is_specular, 1, w);
  if (place.depth.diffuse >= static_cast<Workspace&>(w).depth) return;
  note_readers(place, is_diffuse, static_cast<Workspace&>(w));
  gatherer_.answer(place, place.behind_diffuse(), 1, is_diffuse, 1, w);
}

// Rays of the first set that may read the cache. Those that end at the depth that is asked for are noted; of those
// that read it before, some go on.
void ReaderSurvey::note_readers(const Place& place, const RayFilter& wanted, Workspace& w) const {
  PointBatch& b = w.level(place.level);
  RaySet& r = b.ray_set(0);
  const int depth = place.depth.diffuse + 1;
  const float growth = shader_.cached().growth(place);
  for (int i = 0; i < r.count; ++i) {
    const uint32_t geometry = r.hits.geometry[i];
    if (!wanted(r, i) || geometry == no_id || r.weight[i].is_black()) continue;
    if (depth == w.depth) ++w.ends, w.view_dependent |= !shading_.materials.is_view_independent(geometry);
    if (!shading_.materials.is_flat(geometry)) continue;
    const ReadCell cell = shader_.cached().cell_read(b, place.behind_diffuse(), r, i, growth, w);
    if (depth == w.depth) {
      w.readers.push_back(reader_of(r, i));
      w.widths.push_back(shader_.cached().width_read(b, r, i, growth, settings_.shading.cache_width));
      w.cells.push_back(cell);
      r.weight[i] = RGB();
      continue;
    }
    if (cell.area == 0) continue;
    const int effort = shading_.cell_effort(reader_of(r, i), depth, cell);
    if (effort == 0) continue;
    const float filled = float(settings_.shading.diffuse_rays.at(depth, 1, effort)) /
                         shading_.readers->readers(reader_of(r, i), depth, cell);
    if (to_unit_float(random_of(b.key[r.point[i]], Purpose::survey, r.rays.key[i])) >= filled) r.weight[i] = RGB();
  }
}

}  // namespace dapple::distribution
