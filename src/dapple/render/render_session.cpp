// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/render_session.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "dapple/base/parallel.h"
#include "dapple/base/pool.h"
#include "dapple/base/timer.h"
#include "dapple/integrate/camera_batch.h"

namespace dapple::render {

namespace {

std::vector<Box2i> blocks_of(const Box2i& crop) {
  std::vector<Box2i> blocks;
  integrate::CameraBatch::for_each_block(crop, [&](const Box2i& block) { blocks.push_back(block); });
  return blocks;
}

double pixel_count(const std::vector<Box2i>& areas) {
  double n = 0;
  for (const Box2i& a : areas) n += double(a.max.x - a.min.x) * (a.max.y - a.min.y);
  return n;
}

// What is done and left, in pixel samples.
class ProgressMeter {
 public:
  explicit ProgressMeter(uint32_t most) : most_(most) {}
  /// A pass begins, which gives each pixel of the areas `count` samples.
  void begin(const std::vector<Box2i>& areas, uint32_t samples, uint32_t count) {
    samples_ = samples;
    const double pixels = pixel_count(areas);
    rest_ = pixels * (most_ - samples);
    pass_ = pixels * count;
  }
  void end(double seconds) {
    done_ += pass_;
    if (first_done_ > 0) return;
    first_done_ = done_;
    first_seconds_ = seconds;
  }
  /// With this part of the pass done.
  Progress progress(double part, double seconds, double time_limit) const {
    const double now = done_ + pass_ * part, all = done_ + rest_;
    Progress p{samples_, seconds, now / all, {}};
    // The first samples make the shading grids and fill the caches: they tell nothing of the others.
    if (first_done_ > 0) p.seconds_left = (seconds - first_seconds_) / (now - first_done_) * (all - now);
    if (time_limit > 0) {
      p.fraction = std::max(p.fraction, std::min(1.0, seconds / time_limit));
      p.seconds_left = std::min(p.seconds_left.value_or(infinity), std::max(0.0, time_limit - seconds));
    }
    return p;
  }

 private:
  const uint32_t most_;  // samples a pixel
  uint32_t samples_ = 0;
  double done_ = 0, pass_ = 0, rest_ = 0, first_done_ = 0, first_seconds_ = 0;
};

// False if the work was given up.
template <class Work>
bool unless_stopped(const Work& work) {
  try {
    work();
  } catch (const Stopped&) {
    return false;
  }
  return true;
}

// Relative noise is judged as that of surfaces no darker than so much of the film's mean: that of black ones does not
// show.
constexpr double darkest = 0.1;

// Below a few samples the variance of a pixel is not known.
constexpr uint32_t least_judged = 8;

}  // namespace

uint32_t RenderSession::pass_size(uint32_t done, const StopRules& rules) {
  const bool looked_at = rules.time_limit > 0 || rules.noise_target > 0;
  const uint32_t size = done == 0 ? 1 : looked_at ? std::min(done, 8u) : std::max(128 - std::min(done, 128u), done);
  return std::min(size, rules.pixel_samples - done);
}

uint32_t RenderSession::next_judged(uint32_t samples, double error, double target) {
  const double n = samples, wanted = n * (error / target) * (error / target);
  return uint32_t(std::ceil(std::clamp(wanted, 1.25 * n, 2 * n)));
}

// Standard error of these pixels relative to their mean, or to `least_mean` if that is more; by the judge's errors
// where there are some.
double RenderSession::relative_noise(const Box2i& pixels, const std::vector<float>& errors, double least_mean) const {
  if (errors.empty()) {
    const scene::Film::Noise noise = film_.noise(pixels);
    return noise.variance > 0 ? std::sqrt(noise.variance) / std::max(noise.mean, least_mean) : 0;
  }
  const V2i corner = film_.settings().crop.min;
  double sum = 0;
  for (int y = pixels.min.y; y < pixels.max.y; ++y)
    for (int x = pixels.min.x; x < pixels.max.x; ++x) {
      const float square = errors[size_t(y - corner.y) * size_t(film_.width()) + size_t(x - corner.x)];
      sum += std::isnan(square) ? double(infinity) : double(square);
    }
  return std::sqrt(sum / pixel_count({pixels}));
}

const std::vector<float>& RenderSession::judged(uint32_t samples, StopToken stop) {
  if (judge_ && judged_ != samples) errors_ = judge_(stop), judged_ = samples;
  return errors_;
}

// Of these areas, which blocks are noisier than they may be. Whole blocks decide: a pixel whose samples all missed what
// is rare would not know.
std::vector<Box2i> RenderSession::noisy_blocks(const std::vector<Box2i>& areas, uint32_t samples, StopToken stop) {
  const std::vector<float>& errors = judged(samples, stop);
  const double least_mean = darkest * film_.noise(film_.settings().crop).mean;
  std::vector<Box2i> noisy;
  for (const Box2i& area : areas)
    integrate::CameraBatch::for_each_block(area, [&](const Box2i& block) {
      if (relative_noise(block, errors, least_mean) > rules_.pixel_noise) noisy.push_back(block);
    });
  return noisy;
}

bool RenderSession::reaches_target(uint32_t samples, bool at_end, StopToken stop, SessionResult* result) {
  if (!(rules_.noise_target > 0) || samples < least_judged || samples == looked_) return false;
  if (samples < next_judged_ && !at_end) return false;
  result->relative_error = relative_noise(film_.settings().crop, judged(samples, stop), 0);
  looked_ = samples;
  if (judge_) next_judged_ = next_judged(samples, result->relative_error, rules_.noise_target);
  return result->relative_error <= rules_.noise_target;
}

std::shared_lock<std::shared_mutex> RenderSession::use_film() {
  const std::lock_guard gate(gate_);
  return std::shared_lock(film_in_use_);
}

// One thread looks; the others wait where they would begin their next samples. Without the gate they would go on for as
// long as some thread is within its samples: shared locks do not wait for one that wants all.
void RenderSession::pause_if_wanted() {
  if (!pause_.wants() || pausing_.exchange(true)) return;
  std::function<void()> afterwards;
  {
    const std::lock_guard gate(gate_);
    const std::unique_lock all(film_in_use_);
    afterwards = pause_.look();
  }
  if (afterwards) afterwards();
  pausing_ = false;
}

SessionResult RenderSession::run(const std::atomic<bool>& interrupt, StopToken abandon) {
  const Timer timer;
  const double cpu_start = process_cpu_seconds();
  std::vector<Box2i> areas = blocks_of(film_.settings().crop);
  Pool<integrate::Integrator::Workspace> pool;
  std::atomic<bool> given_up{false};
  bool looks_whole = true;
  SessionResult result;
  std::mutex progress_mutex;
  const uint32_t most = std::max(rules_.pixel_samples, rules_.max_pixel_samples);  // sample sets are made for so many
  ProgressMeter meter(most);
  const uint32_t at_once = pause_.wants ? most_at_once_with_pauses : most_at_once;
  StopRules rules = rules_;  // of the samples that the areas are to have
  for (uint32_t samples = 0; samples < rules.pixel_samples && !interrupt;) {
    const uint32_t count = pass_size(samples, rules);
    std::atomic<size_t> areas_done{0};
    meter.begin(areas, samples, count);
    parallel_for(areas.size(), [&](size_t i) {
      if (interrupt) return;
      auto workspace = pool.take([&] { return integrator_.make_workspace(); });
      const bool whole = unless_stopped([&] {
        for (uint32_t first = 0; first < count && !interrupt; first += at_once) {
          {
            std::shared_lock<std::shared_mutex> in_use;
            if (pause_.wants) in_use = use_film();
            integrator_.render({areas[i], samples + first, std::min(at_once, count - first), most, abandon}, *workspace,
                               film_);
          }
          if (pause_.wants) pause_if_wanted();
        }
      });
      if (!whole) given_up = true;
      pool.give(std::move(workspace));
      const double part = double(++areas_done) / double(areas.size());
      if (!callback_) return;
      const std::unique_lock lock(progress_mutex, std::try_to_lock);
      if (!lock) return;
      callback_(meter.progress(part, timer.seconds(), rules.time_limit - rules.seconds_before));
    });
    if (!given_up) given_up = !unless_stopped([&] { integrator_.finish(pool.idle(), film_); });
    if (interrupt || given_up) break;
    samples += count;
    meter.end(timer.seconds());
    result.samples = std::min(samples, rules_.pixel_samples);
    result.max_samples = samples;
    ++result.passes;
    if (pass_callback_) pass_callback_(result.samples);
    const bool is_late = rules.time_limit > 0 && rules.seconds_before + timer.seconds() >= rules.time_limit;
    bool reached = false;
    // The pass is whole even where this look is not.
    looks_whole = unless_stopped([&] {
      reached = reaches_target(samples, is_late || samples >= most, StopToken(interrupt), &result);
      if (reached || (is_late && judge_) || samples != rules.pixel_samples || samples >= rules.max_pixel_samples)
        return;
      areas = noisy_blocks(areas, samples, StopToken(interrupt));
      if (!areas.empty())
        rules.pixel_samples = std::min(2 * samples, rules.max_pixel_samples);
      else
        reached = reaches_target(samples, true, StopToken(interrupt), &result);
    });
    if (!looks_whole) break;
    if (reached) result.outcome = Outcome::noise_target;
    if (!reached && is_late && samples < (judge_ ? most : rules.pixel_samples)) result.outcome = Outcome::time_limit;
    if (result.outcome != Outcome::finished) break;
  }
  if (interrupt || given_up || !looks_whole) result.outcome = Outcome::interrupted;
  result.caches = integrator_.caches();
  result.shaft_tables = integrator_.shaft_tables();
  for (const auto& w : pool.idle()) {
    result.rays += w->rays;
    result.stages += w->stages;
    result.shafts += w->shafts;
    for (size_t c = 0; c < result.caches.size(); ++c) result.caches[c].counts += w->caches[c];
  }
  result.seconds = timer.seconds();
  result.cpu_seconds = process_cpu_seconds() - cpu_start;
  if (film_.settings().cache_use && !given_up && !abandon.stopped()) integrator_.view_caches(most, film_);
  return result;
}

}  // namespace dapple::render
