// SPDX-License-Identifier: Apache-2.0
#include "dapple/api/scene_impl.h"
#include "dapple/image/atomic_file.h"
#include "dapple/render/live_session.h"

namespace dapple {

namespace {

// Of what on_frame made, so that nothing is copied.
LiveFrame frame_of(const render::LiveFrame& f) {
  LiveFrame frame;
  frame.picture = std::static_pointer_cast<const Picture>(f.shown);
  frame.reduction = f.reduction;
  frame.pixel_samples = f.samples;
  frame.edits = f.edits;
  frame.settled = f.settled;
  frame.seconds = f.seconds;
  return frame;
}

std::optional<LiveFrame> frame_of(const std::shared_ptr<const render::LiveFrame>& f) {
  return f ? std::optional(frame_of(*f)) : std::nullopt;
}

std::exception_ptr outside(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const Error& e) {
    return std::make_exception_ptr(api::outside(e));
  } catch (...) {
    return error;
  }
}

}  // namespace

class LiveSession::Impl {
 public:
  Impl(std::unique_ptr<render::WorkingScene> scene, render::LiveSession::Options options)
      : session(std::move(scene), std::move(options)) {}

  static render::LiveSession::Options options_of(const RenderOptions& options,
                                                 std::function<void(const LiveFrame&)> on_frame) {
    render::LiveSession::Options o;
    o.picture = api::request_of(options);
    o.picture.mixes = true;
    o.film = api::film_of(options);
    o.outside = outside;
    o.on_frame = [on_frame = std::move(on_frame)](render::LiveFrame& f) {
      auto picture = std::make_shared<Picture>(api::frame_of(std::move(f.picture)));
      picture->statistics = api::statistics_of(f.result);
      picture->statistics.pixel_samples = f.samples;
      f.shown = std::move(picture);
      if (on_frame) on_frame(frame_of(f));
    };
    return o;
  }

  render::LiveSession session;
};

LiveSession::LiveSession(Scene&& scene, const RenderOptions& options, std::function<void(const LiveFrame&)> on_frame) {
  impl_ = api::guarded([&] {
    std::unique_ptr<Scene::Impl> taken;
    const Scene::Impl::Busy busy(scene.impl());
    render::LiveSession::Options o = Impl::options_of(options, std::move(on_frame));
    taken = std::move(scene.impl_);
    return std::make_unique<Impl>(std::move(taken->owned), std::move(o));
  });
}
LiveSession::~LiveSession() = default;
LiveSession::LiveSession(LiveSession&&) noexcept = default;

std::future<void> LiveSession::edit(std::function<void(Scene&)> change) {
  return impl_->session.edit([change = std::move(change)](render::WorkingScene& working) {
    Scene scene;
    scene.impl_ = std::make_unique<Scene::Impl>(&working);
    change(scene);
  });
}

std::future<void> LiveSession::edit(const std::string& target, const std::string& name, const Params& params) {
  return edit([target, name, params](Scene& scene) { scene.edit(target, name, params); });
}

std::future<void> LiveSession::remove(const std::string& target, const std::string& name) {
  return edit([target, name](Scene& scene) { scene.remove(target, name); });
}

std::future<void> LiveSession::gain(const std::string& group, const std::array<double, 3>& gain) {
  return impl_->session.gain(group, RGB(float(gain[0]), float(gain[1]), float(gain[2])));
}

std::optional<LiveFrame> LiveSession::frame() const {
  return frame_of(impl_->session.frame());
}

std::optional<LiveFrame> LiveSession::wait(double seconds) const {
  return api::guarded([&] { return frame_of(impl_->session.wait(seconds)); });
}

bool LiveSession::is_own_thread() const {
  return impl_->session.is_own_thread();
}

void LiveSession::write(const std::string& path) {
  api::guarded([&] {
    impl_->session.check_may_wait();
    std::string text;
    impl_->session.look([&](render::WorkingScene& scene) { text = scene.written(path); }).get();
    image::AtomicFile file(path);
    file.write(text.data(), text.size());
    file.commit();
  });
}

}  // namespace dapple
