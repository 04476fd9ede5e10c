// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/live_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "dapple/base/timer.h"

namespace dapple::render {

namespace {

constexpr int reductions[] = {8, 4, 2};

bool only_camera(const build::Changes& c) {
  return c.camera && !c.settings && !c.lights && !c.materials && !c.all;
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

int reduced(int pixels, int reduction) {
  return std::max((pixels + reduction - 1) / reduction, 1);
}

}  // namespace

LiveSession::LiveSession(std::unique_ptr<WorkingScene> scene, Options options)
    : scene_(std::move(scene)), options_(std::move(options)), thread_([this] { run(); }) {}

LiveSession::~LiveSession() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    cancel_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::future<void> LiveSession::edit(std::function<void(WorkingScene&)> change) {
  const std::lock_guard lock(mutex_);
  Transaction& t = queue_.emplace_back();
  t.change = std::move(change);
  ++edits_;
  last_edit_ = std::chrono::steady_clock::now();
  cancel_ = true;
  changed_.notify_all();
  return t.done.get_future();
}

std::future<void> LiveSession::look(std::function<void(WorkingScene&)> look) {
  const std::lock_guard lock(mutex_);
  Transaction& t = queue_.emplace_back();
  t.change = std::move(look);
  t.is_edit = false;
  cancel_ = true;
  changed_.notify_all();
  return t.done.get_future();
}

std::shared_ptr<const LiveFrame> LiveSession::frame() const {
  const std::lock_guard lock(mutex_);
  return frame_;
}

std::shared_ptr<const LiveFrame> LiveSession::wait(double seconds) const {
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
  changed_.wait(lock, [&] { return ends_ || !queue_.empty() || needs_rendering_; });
  if (!ends_) cancel_ = false;
  // Who waits for edits is not told of what was wrong before them.
  if (std::any_of(queue_.begin(), queue_.end(), [](const Transaction& t) { return t.is_edit; }))
    failure_before_ = std::exchange(failure_, nullptr);
  return std::exchange(queue_, {});
}

void LiveSession::run() {
  bool is_first = true;
  for (;;) {
    std::deque<Transaction> transactions = take_transactions();
    {
      const std::lock_guard lock(mutex_);
      if (ends_) return;  // promises that are left are broken, which futures tell
    }
    try {
      if (std::exchange(is_first, false)) {
        if (!scene_->description().dicing_camera && !scene_->description().camera.type.empty())
          scene_->freeze_dicing_camera();
        build();
      }
      for (Transaction& t : transactions) apply(t);
      if (needs_rendering_) render();
    } catch (const Stopped&) {
      needs_rendering_ = true;
    } catch (...) {  // nothing to show until an edit makes it right
      const std::lock_guard lock(mutex_);
      failure_ = outside(std::current_exception());
      needs_rendering_ = false;
      changed_.notify_all();
    }
  }
}

std::exception_ptr LiveSession::outside(std::exception_ptr error) const {
  return options_.outside ? options_.outside(std::move(error)) : error;
}

// One by one: each is right or wrong by itself.
void LiveSession::apply(Transaction& t) {
  if (!t.is_edit) {
    try {
      t.change(*scene_);
      t.done.set_value();
    } catch (...) {
      t.done.set_exception(outside(std::current_exception()));
    }
    return;
  }
  ++shown_edits_;
  needs_rendering_ = true;
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
    needs_rendering_ = built_ != nullptr;
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

// The integrator goes before the scene that it refers to, unless it will serve the new camera as well.
void LiveSession::build() {
  const bool keeps = picture_ && only_camera(scene_->changes()) && build::outlasts_camera(*built_, picture_->request());
  if (!keeps) picture_.reset();
  built_ = &scene_->built(options_.film);
  if (picture_ && !build::outlasts_camera(*built_, picture_->request())) picture_.reset();
  if (picture_) picture_->begin_again();
}

void LiveSession::render() {
  if (!picture_) picture_ = std::make_unique<Picture>(*built_, options_.picture);
  reduced_.clear();
  for (const int reduction : reductions)
    if (!render_reduced(reduction)) return;
  scene::Film film = picture_->make_film();
  RenderSession session(picture_->integrator(), film, picture_->rules());
  session.on_pass([&](uint32_t samples) {
    if (!cancel_) publish(picture_->layers(film, false), 1, samples, nullptr);
  });
  SessionResult result = session.run(cancel_, StopToken(cancel_));
  if (cancel_) {
    picture_->begin_again();
    return;
  }
  for (const SessionResult& r : reduced_) add_counts(r, &result);
  if (picture_->has_opacity_cache()) result.caches.push_back(picture_->opacity_state());
  image::OutputImage settled = picture_->layers(film, true, StopToken(cancel_));
  {
    const std::lock_guard lock(mutex_);
    needs_rendering_ = !queue_.empty();
  }
  publish(std::move(settled), 1, result.samples, &result);
}

// The same camera with fewer pixels; one sample of each.
bool LiveSession::render_reduced(int reduction) {
  scene::Scene& scene = *built_->scene;
  const scene::Camera camera = scene.camera;
  scene::Film::Settings s = scene.film;
  scene::Camera::Settings reduced_camera = camera.settings();
  s.resolution = V2i(reduced(s.resolution.x, reduction), reduced(s.resolution.y, reduction));
  s.crop.min = V2i(s.crop.min.x / reduction, s.crop.min.y / reduction);
  s.crop.max = V2i(std::min(reduced(s.crop.max.x, reduction), s.resolution.x),
                   std::min(reduced(s.crop.max.y, reduction), s.resolution.y));
  reduced_camera.resolution = s.resolution;
  s.light_groups = options_.picture.light_groups ? int(scene.light_groups.names.size()) : 0;
  picture_->begin_again();
  scene::Film film(s);
  StopRules rules;
  rules.pixel_samples = 1;
  scene.camera = scene::Camera(reduced_camera);
  RenderSession session(picture_->integrator(), film, rules);
  try {
    reduced_.push_back(session.run(cancel_, StopToken(cancel_)));
  } catch (...) {
    scene.camera = camera;
    throw;
  }
  scene.camera = camera;
  picture_->begin_again();
  if (cancel_) return false;
  OutputSettings output;
  if (options_.picture.light_groups) output.light_groups = scene.light_groups.names;
  publish(make_output(film, output), reduction, 1, nullptr);
  return true;
}

void LiveSession::publish(image::OutputImage picture, int reduction, uint32_t samples, const SessionResult* settled) {
  auto frame = std::make_shared<LiveFrame>();
  frame->picture = std::move(picture);
  frame->reduction = reduction;
  frame->samples = samples;
  frame->edits = shown_edits_;
  frame->settled = settled != nullptr;
  if (settled) frame->result = *settled;
  {
    const std::lock_guard lock(mutex_);
    frame->seconds = seconds_since(last_edit_);
  }
  if (options_.on_frame) options_.on_frame(frame);
  const std::lock_guard lock(mutex_);
  frame_ = std::move(frame);
  changed_.notify_all();
}

}  // namespace dapple::render
