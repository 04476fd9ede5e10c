// SPDX-License-Identifier: Apache-2.0
// dapple._core.LiveSession, whose calls give up the GIL, which edits want on the session's thread.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "bindings.h"
#include "picture_header.h"

namespace py = pybind11;
using namespace py::literals;

namespace dapple::python {

namespace {

using Seconds = std::chrono::duration<double>;
constexpr Seconds attention(.1);  // between looks at signals

[[noreturn]] void refuse(const char* why) {
  throw SceneError(SceneError::Kind::usage, why);
}

/// A session that a thread may close while others use it. Waits, so not to be called with the GIL.
class OpenSession {
 public:
  OpenSession(Scene& scene, const RenderOptions& options) : session_(std::in_place, std::move(scene), options) {}

  /// SceneError if it is closed.
  template <class Work>
  auto use(const Work& work) {
    const Use use(*this);
    return work(*session_);
  }
  /// Waits for those who use it, for what is under way, and for others who close it.
  void close() {
    std::unique_lock lock(mutex_);
    const bool is_first = !std::exchange(is_closed_, true);
    changed_.wait(lock, [&] { return is_first ? users_ == 0 : is_gone_; });
    if (!is_first) return;
    lock.unlock();
    session_.reset();
    own_thread_ = std::thread::id();
    lock.lock();
    is_gone_ = true;
    changed_.notify_all();
  }
  /// That edits are called on, from the first one on.
  void set_own_thread() { own_thread_ = std::this_thread::get_id(); }
  bool is_own_thread() const { return own_thread_ == std::this_thread::get_id(); }
  /// In a process that was forked, which has no thread of it.
  void abandon() { is_abandoned_ = true; }
  bool is_abandoned() const { return is_abandoned_; }

 private:
  class Use {
   public:
    explicit Use(OpenSession& session) : session_(session) {
      const std::lock_guard lock(session_.mutex_);
      if (session_.is_closed_) refuse("the session is closed");
      ++session_.users_;
    }
    ~Use() {
      const std::lock_guard lock(session_.mutex_);
      --session_.users_;
      session_.changed_.notify_all();
    }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    OpenSession& session_;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  int users_ = 0;
  bool is_closed_ = false, is_gone_ = false;
  std::atomic<bool> is_abandoned_{false};
  std::atomic<std::thread::id> own_thread_;
  std::optional<LiveSession> session_;
};

/// A transaction under way.
class Edit {
 public:
  Edit(std::future<void> done, std::shared_ptr<OpenSession> session)
      : done_(done.share()), session_(std::move(session)) {}

  bool is_done() const { return done_.wait_for(Seconds(0)) == std::future_status::ready; }
  void result() const {
    while (!is_done()) {
      {
        const py::gil_scoped_release release;
        if (session_->is_own_thread()) refuse("an edit cannot wait for another one of its session");
        if (session_->is_abandoned()) refuse("the session is of the process that was forked");
        done_.wait_for(attention);
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    try {
      done_.get();
    } catch (const std::future_error&) {
      refuse("the session was closed before this edit");
    }
  }

 private:
  std::shared_future<void> done_;
  std::shared_ptr<OpenSession> session_;
};

py::object dict_of_frame(const std::optional<LiveFrame>& f) {
  if (!f) return py::none();
  return py::dict("layers"_a = layers_of(f->picture), "statistics"_a = dict_of(f->picture->statistics),
                  "header"_a = header_of(*f->picture), "reduction"_a = f->reduction,
                  "pixel_samples"_a = f->pixel_samples, "edits"_a = f->edits, "settled"_a = f->settled,
                  "seconds"_a = f->seconds);
}

/// Work with a session, without the GIL. SceneError if it is closed, or null.
template <class Work>
auto without_gil(std::shared_ptr<OpenSession> session, const Work& work) {
  if (!session) refuse("the session is closed");
  const py::gil_scoped_release release;
  return session->use(work);
}

class PyLiveSession {
 public:
  PyLiveSession(Scene& scene, const py::dict& options) {
    session_ = std::make_shared<OpenSession>(scene, options_of(options));  // under the GIL: no other takes the scene
  }
  ~PyLiveSession() {
    if (!session_) return;
    const py::gil_scoped_release release;
    if (session_->is_own_thread())  // which cannot wait for itself
      std::thread([session = session_] { session->close(); }).detach();
    else
      session_->close();
  }
  PyLiveSession(const PyLiveSession&) = delete;
  PyLiveSession& operator=(const PyLiveSession&) = delete;

  void close() {
    const auto session = session_;
    if (!session) return;
    const py::gil_scoped_release release;
    if (session->is_own_thread()) refuse("an edit cannot close the session that calls it");
    session->close();
  }
  /// In a process that was forked, where the session has no threads: nothing of it can be ended.
  void abandon() {
    if (!session_) return;
    session_->abandon();
    new std::shared_ptr<OpenSession>(std::move(session_));
  }

  Edit edit(const py::function& change) {
    // Whoever lets go of it last does so under the GIL.
    const std::shared_ptr<py::function> kept(new py::function(change), [](py::function* f) {
      const py::gil_scoped_acquire acquire;
      delete f;
    });
    auto done = without_gil(session_, [&](LiveSession& session) {
      return session.edit([kept, open = session_.get()](Scene& scene) {
        open->set_own_thread();
        const py::gil_scoped_acquire acquire;
        const py::object lent = py::cast(std::move(scene));  // whoever keeps it has an empty one afterwards
        std::optional<std::string> problem;
        try {
          (*kept)(lent);
        } catch (const py::error_already_set& error) {
          problem = error.what();
        }
        scene = std::move(lent.cast<Scene&>());
        if (problem) throw SceneError(SceneError::Kind::usage, *problem);
      });
    });
    return {std::move(done), session_};
  }
  Edit gain(const std::string& group, const std::array<double, 3>& gain) {
    return {without_gil(session_, [&](LiveSession& session) { return session.gain(group, gain); }), session_};
  }

  py::object frame() const {
    return dict_of_frame(without_gil(session_, [](LiveSession& session) { return session.frame(); }));
  }
  py::object wait(double seconds) const {
    const auto end = std::chrono::steady_clock::now() + Seconds(seconds);
    for (;;) {
      const Seconds left = end - std::chrono::steady_clock::now();
      const auto f = without_gil(session_, [&](LiveSession& session) {
        return session.wait(std::clamp(left.count(), 0.0, attention.count()));
      });
      if (f || std::chrono::steady_clock::now() >= end) return dict_of_frame(f);
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }
  void write(const std::string& path) const {
    without_gil(session_, [&](LiveSession& session) { session.write(path); });
  }

 private:
  std::shared_ptr<OpenSession> session_;  ///< null once abandoned
};

}  // namespace

void add_live_session(py::module_& m) {
  py::class_<Edit>(m, "Edit").def("done", &Edit::is_done).def("result", &Edit::result);
  py::class_<PyLiveSession>(m, "LiveSession")
      .def(py::init<Scene&, const py::dict&>())
      .def("edit", &PyLiveSession::edit)
      .def("gain", &PyLiveSession::gain)
      .def("frame", &PyLiveSession::frame)
      .def("wait", &PyLiveSession::wait)
      .def("write", &PyLiveSession::write)
      .def("close", &PyLiveSession::close)
      .def("abandon", &PyLiveSession::abandon);
}

}  // namespace dapple::python
