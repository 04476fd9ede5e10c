// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "dapple/render/picture.h"
#include "dapple/render/working_scene.h"

namespace dapple::render {

/// A picture of a live session as far as it has come.
struct LiveFrame {
  image::OutputImage picture;  ///< its first layer at least
  /// What Options::on_frame made of the picture, which it may have taken out.
  std::shared_ptr<const void> shown;
  int reduction = 1;       ///< its pixels are so many pixels of the film wide
  uint32_t samples = 0;    ///< a pixel
  uint64_t edits = 0;      ///< how many transactions it shows
  bool settled = false;    ///< nothing is left to do until the next edit
  double seconds = 0;      ///< since the last of these edits came in
  SessionResult result{};  ///< of settled frames; counts are those since the edit
};

/// Renders a scene that changes: in a thread of its own, first at an eighth of the resolution, then at a quarter, a
/// half, the whole, then pass by pass. Edits come from other threads at any time, and cancel what is under way. What
/// they keep: docs/guide/interactive.md. Gains of light groups cancel nothing: what was sampled is summed again.
///
/// A settled frame equals, bit for bit, the picture of the scene that written() gives, whatever the edits were and
/// whatever was kept. The session begins by DicingCamera, unless the scene has its own.
class LiveSession {
 public:
  struct Options {
    PictureRequest picture;
    build::FilmOverrides film;
    /// Called with each frame, on one thread of the session at a time; short, for rendering waits for it. May be empty.
    std::function<void(LiveFrame&)> on_frame;
    /// Makes errors what callers know. Empty: they stay.
    std::function<std::exception_ptr(std::exception_ptr)> outside;
  };

  LiveSession(std::unique_ptr<WorkingScene> scene, Options options);
  ~LiveSession();  ///< stops what is under way
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  /// A transaction: `change` is called on the session's thread, and all of it counts or nothing. The future is ready
  /// when the scene is built; it holds the error if that fails or `change` throws, and then the scene is what it was
  /// before this transaction. Returns at once.
  std::future<void> edit(std::function<void(WorkingScene&)> change);
  /// The gain of a light group, as a transaction of its own, which lets rendering go on.
  std::future<void> gain(const std::string& group, const RGB& gain);
  /// Calls `look`, which changes nothing, once the transactions before it are done. Rendering goes on.
  std::future<void> look(std::function<void(WorkingScene&)> look);

  /// The latest; null before the first.
  std::shared_ptr<const LiveFrame> frame() const;
  /// Waits until a frame shows all edits so far and is settled, or until the session cannot render the scene, whose
  /// error it throws. Null after `seconds`. UsageError on the session's own thread.
  std::shared_ptr<const LiveFrame> wait(double seconds = infinity) const;

  /// Where transactions are called, which nothing there may wait for.
  bool is_own_thread() const { return own_thread_ == std::this_thread::get_id(); }
  /// UsageError if is_own_thread().
  void check_may_wait() const;

 private:
  struct Transaction {
    enum class Kind : uint8_t { edit, gain, look } kind = Kind::edit;
    std::function<void(WorkingScene&)> change;
    std::promise<void> done;
  };

  using Kind = Transaction::Kind;

  void run();
  std::deque<Transaction> take_transactions();
  std::future<void> add(Transaction transaction);
  void look(Transaction& transaction);
  void apply(Transaction& transaction);
  void build();
  void build_first();
  void fail();
  void set_scene_gains(scene::Film& film) const;
  void render();
  bool sketch(const build::IntegratorRequest& request);
  bool render_reduced(bool is_sketched, bool only_finishes);
  bool render_view(const integrate::Integrator& integrator, scene::Film& film, RenderSession::Pause pause,
                   int reduction, uint32_t samples, bool is_sketch);
  void show_whole();
  RenderSession::Pause pause_for_gains(scene::Film& film, const uint32_t& samples);
  bool take_gains(std::unique_ptr<Transaction>* look);
  bool needs_samples(Transaction& gain);
  void check_gains() const;
  std::exception_ptr outside(std::exception_ptr error) const;
  void publish(image::OutputImage picture, int reduction, uint32_t samples, const SessionResult* settled);

  std::unique_ptr<WorkingScene> scene_;
  const Options options_;
  std::shared_ptr<const gi::OpacityCache> opacity_;  ///< of the last picture; refers to the scene as built
  build::Preparations prepared_;                     ///< of the scene as built, for whatever lights
  std::unique_ptr<Picture> picture_;
  build::BuiltScene* built_ = nullptr;
  /// Of picture_, with all its samples; null before that.
  std::unique_ptr<scene::Film> film_;
  SessionResult film_result_;
  bool needs_rendering_ = true, needs_showing_ = false;
  /// picture_'s integrator has shaded what the camera sees, but for shaders' stages for viewers: samples are only
  /// finished.
  bool is_shaded_ = false;
  bool noisy_is_shown_ = false;  ///< film_ as it is now, without denoising
  uint64_t shown_edits_ = 0;
  std::vector<SessionResult> reduced_;  ///< of this picture

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<Transaction> queue_;
  uint64_t edits_ = 0;  ///< that came in
  std::chrono::steady_clock::time_point last_edit_ = std::chrono::steady_clock::now();
  std::shared_ptr<const LiveFrame> frame_;
  std::exception_ptr failure_, failure_before_;  ///< of the scene as it is; before the edits under way
  bool ends_ = false;
  std::atomic<bool> cancel_{false}, abandon_{false};  ///< abandon_: what is shaded is of no use after the edit
  std::atomic<bool> has_news_{false};                 ///< gains too
  std::atomic<bool> has_looks_{false};
  std::atomic<std::thread::id> own_thread_;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace dapple::render
