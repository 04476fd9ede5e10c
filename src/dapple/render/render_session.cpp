// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/render_session.h"

#include <algorithm>
#include <mutex>

#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"

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

}  // namespace

uint32_t RenderSession::pass_size(uint32_t done, const StopRules& rules) {
  const bool looked_at = rules.time_limit > 0 || rules.noise_target > 0;
  const uint32_t size = done == 0 ? 1 : looked_at ? std::min(done, 8u) : std::max(128 - std::min(done, 128u), done);
  return std::min(size, rules.pixel_samples - done);
}

SessionResult RenderSession::run(const std::atomic<bool>& interrupt) {
  const Timer timer;
  const std::vector<Box2i> tiles = make_tiles(film_.settings().crop, tile_size);
  WorkspacePool pool(integrator_);
  SessionResult result;
  std::mutex progress_mutex;
  while (result.samples < rules_.pixel_samples && !interrupt) {
    const uint32_t count = pass_size(result.samples, rules_);
    std::atomic<size_t> tiles_done{0};
    parallel_for(tiles.size(), [&](size_t i) {
      if (interrupt) return;
      auto workspace = pool.take();
      for (uint32_t first = 0; first < count && !interrupt; first += most_at_once)
        integrator_.render({tiles[i], result.samples + first, std::min(most_at_once, count - first), rules_.pixel_samples}, *workspace, film_);
      pool.give(std::move(workspace));
      const size_t done = ++tiles_done;
      if (!callback_) return;
      const std::unique_lock lock(progress_mutex, std::try_to_lock);
      if (!lock) return;
      Progress p{result.samples, rules_.pixel_samples, timer.seconds(), 0};
      p.fraction = (result.samples + count * double(done) / double(tiles.size())) / rules_.pixel_samples;
      if (rules_.time_limit > 0) p.fraction = std::max(p.fraction, std::min(1.0, p.seconds / rules_.time_limit));
      callback_(p);
    });
    integrator_.finish(pool.idle(), film_);
    if (interrupt) break;
    result.samples += count;
    ++result.passes;
    if (rules_.time_limit > 0 && timer.seconds() >= rules_.time_limit && result.samples < rules_.pixel_samples) {
      result.outcome = Outcome::time_limit;
      break;
    }
    // Below a few samples the variance of a pixel is not known.
    if (rules_.noise_target > 0 && result.samples >= 8) {
      result.relative_error = film_.relative_error();
      if (result.relative_error <= rules_.noise_target) {
        result.outcome = Outcome::noise_target;
        break;
      }
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
