// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/live_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "dapple/base/timer.h"
#include "dapple/render/gains.h"
#include "dapple/render/reduced_view.h"
#include "dapple/scenefile/scene_writing.h"

namespace dapple::render {

namespace {

constexpr int reductions[] = {8, 4, 2}, finished_reduction = 4;
constexpr uint32_t sketch_samples = 4;

bool only_camera_or_gains(const build::Changes& c) {
  return !c.settings && !c.lights && !c.area_lights && !c.materials && !c.geometry && !c.all;
}

// What is cut out is what it was, and so are the options.
bool keeps_surfaces(const build::Changes& c) {
  return !c.settings && !c.area_lights && !c.materials && !c.geometry && !c.all;
}

// Paths do not depend on lights, and begin at the dicing camera. A mesh that becomes a lamp, or no longer is one, is
// hit elsewhere by rounding.
bool keeps_paths(const build::Changes& c) {
  return !c.settings && !c.emitters && !c.materials && !c.geometry && !c.all;
}

double seconds_since(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - time).count();
}

// What was done for one picture.
void add_counts(const SessionResult& from, SessionResult* to) {
  to->rays += from.rays;
  to->stages += from.stages;
  to->shafts += from.shafts;
  for (size_t c = 0; c < std::min(from.caches.size(), to->caches.size()); ++c)
    to->caches[c].counts += from.caches[c].counts;
}

integrate::CacheCounts since(const integrate::CacheCounts& before, integrate::CacheCounts now) {
  now.lookups -= before.lookups, now.hits -= before.hits, now.fills -= before.fills;
  now.fill_seconds -= before.fill_seconds;
  return now;
}

std::string reduced_text(int reduction, const V2i& film, bool is_sketch) {
  return "1/" + std::to_string(reduction) + " of " + std::to_string(film.x) + " x " + std::to_string(film.y) +
         (is_sketch ? ", a sketch" : "");
}

// The same film with nothing done for it.
SessionResult without_counts(SessionResult r) {
  r.seconds = r.cpu_seconds = 0;
  r.rays = {}, r.stages = {}, r.shafts = {};
  for (integrate::CacheState& c : r.caches) c.counts = {};
  return r;
}

}  // namespace

LiveSession::LiveSession(std::unique_ptr<WorkingScene> scene, Options options)
    : scene_(std::move(scene)), options_(std::move(options)), thread_([this] { run(); }) {}

LiveSession::~LiveSession() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    cancel_ = abandon_ = has_news_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::future<void> LiveSession::add(Transaction transaction) {
  const std::lock_guard lock(mutex_);
  if (transaction.kind != Kind::look) {
    ++edits_;
    last_edit_ = std::chrono::steady_clock::now();
  }
  (transaction.kind == Kind::look ? has_looks_ : has_news_) = true;
  if (transaction.kind == Kind::edit) cancel_ = abandon_ = true;
  Transaction& t = queue_.emplace_back(std::move(transaction));
  changed_.notify_all();
  return t.done.get_future();
}

std::future<void> LiveSession::edit(std::function<void(WorkingScene&)> change) {
  return add({Kind::edit, std::move(change), {}});
}

std::future<void> LiveSession::gain(const std::string& group, const RGB& gain) {
  std::string text = " \"rgb gain\" [";
  for (int c = 0; c < 3; ++c) text += ' ' + scenefile::text_of(double(gain[c]));
  return add(
      {Kind::gain,
       [group, text = text + " ]"](WorkingScene& scene) { scene.edit(scenefile::EditTarget::group, group, text); },
       {}});
}

std::future<void> LiveSession::look(std::function<void(WorkingScene&)> look) {
  return add({Kind::look, std::move(look), {}});
}

std::shared_ptr<const LiveFrame> LiveSession::frame() const {
  const std::lock_guard lock(mutex_);
  return frame_;
}

void LiveSession::check_may_wait() const {
  if (is_own_thread()) throw UsageError("an edit cannot wait for the session that calls it");
}

std::shared_ptr<const LiveFrame> LiveSession::wait(double seconds) const {
  check_may_wait();
  std::unique_lock lock(mutex_);
  const auto ready = [&] {
    return (failure_ && queue_.empty()) || (frame_ && frame_->settled && frame_->edits == edits_ && queue_.empty());
  };
  if (seconds < 1e9) {
    if (!changed_.wait_for(lock, std::chrono::duration<double>(seconds), ready)) return nullptr;
  } else {
    changed_.wait(lock, ready);
  }
  if (failure_) std::rethrow_exception(failure_);
  return frame_;
}

std::deque<LiveSession::Transaction> LiveSession::take_transactions() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return ends_ || !queue_.empty() || needs_rendering_ || needs_showing_; });
  if (!ends_) cancel_ = abandon_ = has_news_ = has_looks_ = false;
  // Who waits for edits is not told of what was wrong before them.
  if (std::any_of(queue_.begin(), queue_.end(), [](const Transaction& t) { return t.kind != Kind::look; }))
    failure_before_ = std::exchange(failure_, nullptr);
  return std::exchange(queue_, {});
}

void LiveSession::run() {
  own_thread_ = std::this_thread::get_id();
  bool is_first = true;
  for (;;) {
    std::deque<Transaction> transactions = take_transactions();
    {
      const std::lock_guard lock(mutex_);
      if (ends_) return;  // promises that are left are broken, which futures tell
    }
    try {
      if (std::exchange(is_first, false)) build_first();
      for (Transaction& t : transactions) t.kind == Kind::look ? look(t) : apply(t);
      if (needs_rendering_) render();
      if (needs_showing_) show_whole();
    } catch (const Stopped&) {  // what was under way is still needed
    } catch (...) {             // nothing to show until an edit makes it right
      fail();
    }
  }
}

// Edits that came meanwhile may make right what is wrong.
void LiveSession::build_first() {
  try {
    build();
  } catch (...) {
    fail();
    failure_before_ = failure_;
  }
}

// By the exception that is being handled.
void LiveSession::fail() {
  const std::lock_guard lock(mutex_);
  failure_ = outside(std::current_exception());
  needs_rendering_ = needs_showing_ = false;
  changed_.notify_all();
}

std::exception_ptr LiveSession::outside(std::exception_ptr error) const {
  return options_.outside ? options_.outside(std::move(error)) : error;
}

void LiveSession::look(Transaction& t) {
  try {
    t.change(*scene_);
    t.done.set_value();
  } catch (...) {
    t.done.set_exception(outside(std::current_exception()));
  }
}

// One by one: each is right or wrong by itself.
void LiveSession::apply(Transaction& t) {
  ++shown_edits_;
  try {
    const auto before = scene_->checkpoint();
    try {
      t.change(*scene_);
      build();
    } catch (...) {
      scene_->restore(before);
      throw;
    }
    const std::lock_guard lock(mutex_);
    failure_ = nullptr;
  } catch (...) {
    needs_showing_ = film_ != nullptr;
    needs_rendering_ = built_ && !film_;
    if (!built_) {
      const std::lock_guard lock(mutex_);
      failure_ = failure_before_;
      changed_.notify_all();
    }
    t.change = {};
    t.done.set_exception(outside(std::current_exception()));
    return;
  }
  t.change = {};  // it may hold what is of its owner's world, and the owner goes on from here
  t.done.set_value();
}

void LiveSession::set_scene_gains(scene::Film& film) const {
  if (film.settings().light_groups > 0) film.set_gains(built_->scene->light_groups.gains);
}

// While what is built is as it was: then a transaction can still be taken back. Gains of groups that come with it are
// judged when the picture is made.
void LiveSession::check_gains() const {
  const build::Changes& c = scene_->changes();
  if (!built_ || !c.gains) return;
  const PictureRequest& asked = options_.picture;
  const build::IntegratorRequest request =
      asked.integrator.over(c.settings || c.all ? scene_->described_request() : built_->request);
  render::check_gains(scene_->described_gains(), {request, asked.aovs, asked.noise_target});
}

// The integrator goes before the scene that it refers to, unless it will serve what has changed as well.
void LiveSession::build() {
  check_gains();
  if (!scene_->description().dicing_camera && !scene_->description().camera.type.empty())
    scene_->freeze_dicing_camera();
  const build::Changes changes = scene_->changes();
  const GainReach reach = picture_ && changes.gains ? picture_->reach_of(scene_->described_gains()) : GainReach::sums;
  const bool keeps = picture_ && only_camera_or_gains(changes) && reach != GainReach::stored &&
                     (!changes.camera || build::outlasts_camera(*built_, picture_->request()));
  if (!keeps || changes.camera || reach != GainReach::sums) film_.reset();
  if (!keeps) picture_.reset();
  if (!keeps_surfaces(changes)) opacity_.reset();
  built_ = &scene_->built(options_.film);
  if (!keeps_paths(scene_->made_again())) prepared_ = {};
  if (picture_ && changes.camera && !build::outlasts_camera(*built_, picture_->request())) picture_.reset();
  if (picture_ && changes.camera) picture_->begin_again();
  is_shaded_ &= picture_ && !changes.camera;
  if (film_) {
    set_scene_gains(*film_);
    film_result_ = without_counts(film_result_);
    noisy_is_shown_ = false;
  }
  needs_showing_ = film_ != nullptr;
  needs_rendering_ = !film_;
}

void LiveSession::render() {
  reduced_.clear();
  const bool only_finishes = std::exchange(is_shaded_, false);
  const build::IntegratorRequest request = options_.picture.integrator.over(built_->request);
  const bool sketches = !picture_ && request.type != "ao";  // which has nothing to prepare
  if (sketches && !sketch(request)) return;
  if (!picture_)
    picture_ = std::make_unique<Picture>(*built_, options_.picture, StopToken(cancel_), opacity_, &prepared_);
  opacity_ = picture_->opacity_cache();
  const integrate::CacheCounts opacity_before = opacity_ ? picture_->opacity_state().counts : integrate::CacheCounts();
  if (!render_reduced(sketches, only_finishes)) {
    is_shaded_ = only_finishes && !abandon_;
    return;
  }
  auto film = std::make_unique<scene::Film>(picture_->make_film());
  RenderSession session(picture_->integrator(), *film, picture_->rules());
  picture_->judge(session, *film);
  uint32_t whole_samples = 0;
  session.on_pass([&](uint32_t samples) {
    whole_samples = samples;
    if (!cancel_) publish(picture_->layers(*film, false), 1, samples, nullptr);
  });
  session.on_pause(pause_for_gains(*film, whole_samples));
  SessionResult result = session.run(cancel_, StopToken(abandon_));
  is_shaded_ = (only_finishes || whole_samples > 0) && !abandon_;
  if (cancel_) {
    if (!is_shaded_) picture_->begin_again();
    return;
  }
  for (const SessionResult& r : reduced_) add_counts(r, &result);
  if (opacity_) {
    result.caches.push_back(picture_->opacity_state());
    result.caches.back().counts = since(opacity_before, result.caches.back().counts);
  }
  film_ = std::move(film);
  film_result_ = std::move(result);
  noisy_is_shown_ = true;
  needs_rendering_ = false;
  needs_showing_ = true;
}

// Gains that came in while it rendered become true between samples.
RenderSession::Pause LiveSession::pause_for_gains(scene::Film& film, const uint32_t& samples) {
  return {[this] { return (has_news_ || has_looks_) && !cancel_; },
          [this, &film, &samples]() -> std::function<void()> {
            std::shared_ptr<image::OutputImage> picture;
            auto looks = std::make_shared<std::unique_ptr<Transaction>>();
            if (take_gains(looks.get())) {
              set_scene_gains(film);
              if (samples > 0) picture = std::make_shared<image::OutputImage>(picture_->layers(film, false, {}, false));
            }
            return [this, picture, looks, samples] {
              if (picture) publish(std::move(*picture), 1, samples, nullptr);
              if (*looks) look(**looks);
            };
          }};
}

// Of gains that the film cannot show; not of those that will be refused.
bool LiveSession::needs_samples(Transaction& gain) {
  const auto before = scene_->checkpoint();
  bool needs = false;
  try {
    gain.change(*scene_);
    check_gains();
    needs = picture_->reach_of(scene_->described_gains()) != GainReach::sums;
  } catch (...) {  // which is told when it is applied
  }
  scene_->restore(before);
  return needs;
}

// False if there was none that the film can show. Those that need other samples, and what comes after them, stay; so
// does what comes after somebody who wants to look.
bool LiveSession::take_gains(std::unique_ptr<Transaction>* look) {
  std::deque<Transaction> gains;
  {
    const std::lock_guard lock(mutex_);
    for (; !cancel_ && !queue_.empty() && queue_.front().kind == Kind::gain; queue_.pop_front()) {
      if (!picture_->weighs_gains() && needs_samples(queue_.front())) {
        cancel_ = true;
        break;
      }
      gains.push_back(std::move(queue_.front()));
    }
    if (!cancel_ && !queue_.empty() && queue_.front().kind == Kind::look) {
      *look = std::make_unique<Transaction>(std::move(queue_.front()));
      queue_.pop_front();
    }
    has_news_ = cancel_ || std::any_of(queue_.begin(), queue_.end(), [](auto& t) { return t.kind != Kind::look; });
    has_looks_ = std::any_of(queue_.begin(), queue_.end(), [](auto& t) { return t.kind == Kind::look; });
  }
  for (Transaction& t : gains) apply(t);
  return !gains.empty();
}

void LiveSession::show_whole() {
  if (!noisy_is_shown_ && picture_->denoises())
    publish(picture_->layers(*film_, false), 1, film_result_.samples, nullptr);
  noisy_is_shown_ = true;
  image::OutputImage settled = picture_->layers(*film_, true, StopToken(has_news_));
  add_to_header(film_result_, &settled);
  needs_showing_ = false;
  publish(std::move(settled), 1, film_result_.samples, &film_result_);
}

// What is there before the integrator is, which learns lights and counts readers first: paths that learned little.
bool LiveSession::sketch(const build::IntegratorRequest& request) {
  scene::Scene& scene = *built_->scene;
  const bool has_groups = options_.picture.light_groups || scene.light_groups.has_gains();
  ReducedView view(scene, reductions[0], has_groups ? int(scene.light_groups.names.size()) : 0);
  const auto paths = build::make_integrator(scene, build::sketch_request(request), sketch_samples,
                                            request.seed.value_or(0), StopToken(cancel_));
  return render_view(*paths, view.film(), {}, reductions[0], sketch_samples, true);
}

// What is shaded is what the samples of the whole view found.
bool LiveSession::render_reduced(bool is_sketched, bool only_finishes) {
  const uint32_t nothing_to_show = 0;
  for (const int reduction : reductions) {
    if (only_finishes ? reduction != finished_reduction : is_sketched && reduction == reductions[0]) continue;
    if (!only_finishes) picture_->begin_again();
    ReducedView view(*built_->scene, reduction, picture_->film_groups(),
                     only_finishes ? ReducedView::Pixels::sparse : ReducedView::Pixels::wide);
    const bool whole = render_view(picture_->integrator(), view.film(), pause_for_gains(view.film(), nothing_to_show),
                                   reduction, 1, false);
    if (!only_finishes) picture_->begin_again();
    if (!whole) return false;
  }
  return true;
}

// False if it was cancelled.
bool LiveSession::render_view(const integrate::Integrator& integrator, scene::Film& film, RenderSession::Pause pause,
                              int reduction, uint32_t samples, bool is_sketch) {
  StopRules rules;
  rules.pixel_samples = samples;
  RenderSession session(integrator, film, rules);
  session.on_pause(std::move(pause));
  SessionResult result = session.run(cancel_, StopToken(abandon_));
  if (cancel_) return false;
  reduced_.push_back(std::move(result));
  OutputSettings output;
  if (options_.picture.light_groups) output.light_groups = built_->scene->light_groups.names;
  const build::IntegratorRequest request = options_.picture.integrator.over(built_->request);
  output.metadata = scene_header(*built_, request.seed.value_or(0));
  output.metadata.push_back({"dapple/denoised", "no"});
  output.metadata.push_back({"dapple/reduced", reduced_text(reduction, built_->scene->film.resolution, is_sketch)});
  if (integrator.samples_are_independent()) output.metadata.push_back({"dapple/independentSamples", 1});
  publish(make_output(film, output), reduction, samples, nullptr);
  return true;
}

void LiveSession::publish(image::OutputImage picture, int reduction, uint32_t samples, const SessionResult* settled) {
  auto frame = std::make_shared<LiveFrame>();
  frame->picture = std::move(picture);
  if (!settled) frame->picture.metadata.push_back({"dapple/samples", int(samples)});
  frame->reduction = reduction;
  frame->samples = samples;
  frame->edits = shown_edits_;
  frame->settled = settled != nullptr;
  if (settled) frame->result = *settled;
  {
    const std::lock_guard lock(mutex_);
    frame->seconds = seconds_since(last_edit_);
  }
  if (options_.on_frame) options_.on_frame(*frame);
  const std::lock_guard lock(mutex_);
  frame_ = std::move(frame);
  changed_.notify_all();
}

}  // namespace dapple::render
