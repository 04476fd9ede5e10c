// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/render_session.h"

#include <algorithm>
#include <mutex>

#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/integrate/camera_batch.h"

namespace dapple::render {

namespace {

// Workspaces are handed out once a tile; which one a tile gets changes nothing.
class WorkspacePool {
 public:
  using Ptr = std::unique_ptr<integrate::Integrator::Workspace>;

  explicit WorkspacePool(const integrate::Integrator& integrator) : integrator_(integrator) {}
  Ptr take() {
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        Ptr w = std::move(free_.back());
        free_.pop_back();
        return w;
      }
    }
    return integrator_.make_workspace();
  }
  void give(Ptr w) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(w));
  }
  const std::vector<Ptr>& idle() const { return free_; }

 private:
  const integrate::Integrator& integrator_;
  std::mutex mutex_;
  std::vector<Ptr> free_;
};

// Tiles aligned to the full film, so that a crop renders the same blocks as the whole.
std::vector<Box2i> make_tiles(const Box2i& crop, int size) {
  std::vector<Box2i> tiles;
  for (int y = crop.min.y / size * size; y < crop.max.y; y += size)
    for (int x = crop.min.x / size * size; x < crop.max.x; x += size)
      tiles.push_back(Box2i(V2i(std::max(x, crop.min.x), std::max(y, crop.min.y)),
                            V2i(std::min(x + size, crop.max.x), std::min(y + size, crop.max.y))));
  return tiles;
}

double pixel_count(const std::vector<Box2i>& areas) {
  double n = 0;
  for (const Box2i& a : areas) n += double(a.max.x - a.min.x) * (a.max.y - a.min.y);
  return n;
}

// Relative noise is judged as that of surfaces no darker than so much of the film's mean: that of black ones does not show.
constexpr double darkest = 0.1;

}  // namespace

uint32_t RenderSession::pass_size(uint32_t done, const StopRules& rules) {
  const bool looked_at = rules.time_limit > 0 || rules.noise_target > 0;
  const uint32_t size = done == 0 ? 1 : looked_at ? std::min(done, 8u) : std::max(128 - std::min(done, 128u), done);
  return std::min(size, rules.pixel_samples - done);
}

// Of these areas, which blocks are noisier than they may be. Whole blocks decide: a pixel whose samples all missed what is rare would not know.
std::vector<Box2i> RenderSession::noisy_blocks(const std::vector<Box2i>& areas) const {
  const double least_mean = darkest * film_.noise(film_.settings().crop).mean;
  std::vector<Box2i> noisy;
  for (const Box2i& area : areas)
    integrate::CameraBatch::for_each_block(area, [&](const Box2i& block) {
      const scene::Film::Noise noise = film_.noise(block);
      if (std::sqrt(noise.variance) > rules_.pixel_noise * std::max(noise.mean, least_mean)) noisy.push_back(block);
    });
  return noisy;
}

SessionResult RenderSession::run(const std::atomic<bool>& interrupt) {
  const Timer timer;
  std::vector<Box2i> areas = make_tiles(film_.settings().crop, tile_size);
  WorkspacePool pool(integrator_);
  SessionResult result;
  std::mutex progress_mutex;
  const uint32_t most = std::max(rules_.pixel_samples, rules_.max_pixel_samples);  // sample sets are made for so many
  double done = 0, rate_done = 0, rate_start = 0;  // pixel samples; from when on, in s, they tell the speed
  StopRules rules = rules_;  // of the samples that the areas are to have
  for (uint32_t samples = 0; samples < rules.pixel_samples && !interrupt;) {
    const uint32_t count = pass_size(samples, rules);
    std::atomic<size_t> areas_done{0};
    const double pixels = pixel_count(areas);
    parallel_for(areas.size(), [&](size_t i) {
      if (interrupt) return;
      auto workspace = pool.take();
      for (uint32_t first = 0; first < count && !interrupt; first += most_at_once)
        integrator_.render({areas[i], samples + first, std::min(most_at_once, count - first), most}, *workspace, film_);
      pool.give(std::move(workspace));
      const double part = double(++areas_done) / double(areas.size());
      if (!callback_) return;
      const std::unique_lock lock(progress_mutex, std::try_to_lock);
      if (!lock) return;
      const double now = done + pixels * count * part, all = done + pixels * (most - samples);
      Progress p{samples, timer.seconds(), now / all, {}};
      // The first samples make the shading grids and fill the caches: they tell nothing of the others.
      if (samples > 0) p.seconds_left = (p.seconds - rate_start) / (now - rate_done) * (all - now);
      if (rules.time_limit > 0) {
        p.fraction = std::max(p.fraction, std::min(1.0, p.seconds / rules.time_limit));
        p.seconds_left = std::min(p.seconds_left.value_or(infinity), std::max(0.0, rules.time_limit - p.seconds));
      }
      callback_(p);
    });
    integrator_.finish(pool.idle(), film_);
    if (interrupt) break;
    samples += count;
    done += pixels * count;
    if (rate_done == 0) {
      rate_done = done;
      rate_start = timer.seconds();
    }
    result.samples = std::min(samples, rules_.pixel_samples);
    result.max_samples = samples;
    ++result.passes;
    // Below a few samples the variance of a pixel is not known.
    if (rules.noise_target > 0 && samples >= 8) {
      result.relative_error = film_.relative_error();
      if (result.relative_error <= rules.noise_target) {
        result.outcome = Outcome::noise_target;
        break;
      }
    }
    if (samples == rules.pixel_samples && samples < rules.max_pixel_samples) {
      areas = noisy_blocks(areas);
      if (!areas.empty()) rules.pixel_samples = std::min(2 * samples, rules.max_pixel_samples);
    }
    if (rules.time_limit > 0 && timer.seconds() >= rules.time_limit && samples < rules.pixel_samples) {
      result.outcome = Outcome::time_limit;
      break;
    }
  }
  if (interrupt) result.outcome = Outcome::interrupted;
  result.caches = integrator_.caches();
  for (const auto& w : pool.idle()) {
    result.rays += w->rays;
    result.stages += w->stages;
    for (size_t c = 0; c < result.caches.size(); ++c) result.caches[c].counts += w->caches[c];
  }
  result.seconds = timer.seconds();
  if (film_.settings().cache_use) integrator_.view_caches(rules_.pixel_samples, film_);
  return result;
}

}  // namespace dapple::render
