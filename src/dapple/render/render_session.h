// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <vector>

#include "dapple/integrate/integrator.h"

namespace dapple::render {

/// When to stop: whichever of the limits comes first.
struct StopRules {
  uint32_t pixel_samples = 16;
  /// Then, blocks of the image that are noisier than `pixel_noise` get as many samples as they have once more, and so
  /// on up to this number. Not more than pixel_samples: none do.
  uint32_t max_pixel_samples = 0;
  double pixel_noise =
      0.07;               ///< standard error of a pixel, root mean square over its block, relative to the block's mean
  double time_limit = 0;  ///< s of rendering, 0 = none; looked at between passes, so the image is that of whole passes
  double seconds_before = 0;  ///< s of set-up that count towards time_limit
  double noise_target = 0;    ///< relative RMSE by the film's own estimate or RenderSession::judge_by(), 0 = none;
                              ///< looked at between passes
};

/// Where a rendering stands, for progress displays.
struct Progress {
  uint32_t samples_done = 0;  ///< a pixel, in finished passes; of the blocks that are still rendered
  double seconds = 0;
  double fraction =
      0;  ///< of the most work that may be needed, by the rule that will end it; blocks of the current pass included
  std::optional<double>
      seconds_left;  ///< for the rest of that; not known before the first pass is done, but by a time limit
};

enum class Outcome { finished, time_limit, noise_target, interrupted };

struct SessionResult {
  Outcome outcome = Outcome::finished;
  uint32_t samples = 0;      ///< camera samples that every pixel has of finished passes
  uint32_t max_samples = 0;  ///< that pixels have at most, where StopRules::max_pixel_samples gave noisy blocks more
  uint32_t passes = 0;
  double seconds = 0;
  double cpu_seconds = 0;     ///< of the process meanwhile, all threads
  double relative_error = 0;  ///< of the picture, as StopRules::noise_target has it, where that asked for it, and
                              ///< there are 8 samples; of what is there after an interrupt it is the last look's
  integrate::RayCounts rays;
  integrate::StageCounts stages;
  integrate::ShaftCounts shafts;
  integrate::ShaftTables shaft_tables;
  std::vector<integrate::CacheState> caches;
};

/// Renders in progressive passes over blocks of pixels, on all threads. The image does not depend on the number of
/// threads, the order of blocks or how samples fall into passes. A crop shows the pixels of the whole image; but which
/// blocks are noisy is judged by what the crop shows.
class RenderSession {
 public:
  RenderSession(const integrate::Integrator& integrator, scene::Film& film, const StopRules& rules)
      : integrator_(integrator), film_(film), rules_(rules) {}

  /// Called now and then from a rendering thread, one call at a time.
  void on_progress(std::function<void(const Progress&)> callback) { callback_ = std::move(callback); }
  /// Called on the thread of run(), after each whole pass with the camera samples that every pixel has: the film may be
  /// read meanwhile.
  void on_pass(std::function<void(uint32_t samples)> callback) { pass_callback_ = std::move(callback); }
  /// Squares of the relative errors of pixels, row-major over the film's crop, by whose means a noise target and noisy
  /// blocks are judged in place of the film's own variances: such as what denoising leaves. NaN counts as infinity.
  /// Called on the thread of run() between passes and at the end, once for the same samples. None: the film's count
  /// after all. May throw Stopped.
  using Judge = std::function<std::vector<float>(StopToken)>;
  void judge_by(Judge judge) { judge_ = std::move(judge); }
  /// Where `wants` says so, which any rendering thread asks between samples of a block, `look` is called on one of
  /// them while no sample is under way, once the others are between theirs, too: the film may be read, and no loop run
  /// in parallel. What it returns, if anything, is called when samples are under way again.
  struct Pause {
    std::function<bool()> wants;
    std::function<std::function<void()>()> look;
  };
  void on_pause(Pause pause) { pause_ = std::move(pause); }
  /// Renders until a rule stops it, or until `interrupt` becomes true: then blocks that are under way come to their
  /// next samples, and the film holds what is done, pixels with different numbers of samples. When `abandon` says so,
  /// these blocks are given up in the middle of a sample, within a batch of rays; it is to follow an interrupt.
  SessionResult run(const std::atomic<bool>& interrupt, StopToken abandon = {});

  /// Samples of a pixel between which `interrupt` is looked at: each time costs leaves 16 camera rays a pixel
  /// (docs/design/016).
  static constexpr uint32_t most_at_once = 64;
  static constexpr uint32_t most_at_once_with_pauses = 16;
  /// Samples of a pass when `done` are finished: 1, 127, 128, 256, 512, and so on: the first gives a whole image soon,
  /// and of the fewer parts of the scene that are left for later passes to find, the less is computed again for small
  /// caches (docs/design/018). Where passes are looked at: 1, 1, 2, 4, 8, 8, and so on.
  static uint32_t pass_size(uint32_t done, const StopRules& rules);

  /// Samples a pixel at which a judge is asked again, who found `error` at so many: where the target is reached if
  /// errors fall as noise does, but after a quarter more at the earliest, and after as many again at the latest.
  static uint32_t next_judged(uint32_t samples, double error, double target);

 private:
  double relative_noise(const Box2i& pixels, const std::vector<float>& errors, double least_mean) const;
  const std::vector<float>& judged(uint32_t samples, StopToken stop);
  std::vector<Box2i> noisy_blocks(const std::vector<Box2i>& areas, uint32_t samples, StopToken stop);
  bool reaches_target(uint32_t samples, bool at_end, StopToken stop, SessionResult* result);
  std::shared_lock<std::shared_mutex> use_film();
  void pause_if_wanted();

  const integrate::Integrator& integrator_;
  scene::Film& film_;
  const StopRules rules_;
  std::function<void(const Progress&)> callback_;
  std::function<void(uint32_t)> pass_callback_;
  Judge judge_;
  uint32_t next_judged_ = 0;
  std::vector<float> errors_;         ///< the judge's latest; empty: there is none
  uint32_t judged_ = 0, looked_ = 0;  ///< samples of these, and of SessionResult::relative_error
  Pause pause_;
  std::mutex gate_;                ///< before film_in_use_; held by who waits for all of it
  std::shared_mutex film_in_use_;  ///< shared by threads that add samples, where there is a Pause
  std::atomic<bool> pausing_{false};
};

}  // namespace dapple::render
