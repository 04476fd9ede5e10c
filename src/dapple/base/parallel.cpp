// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>

#ifdef DAPPLE_STD_THREADS
#include <exception>
#include <mutex>
#include <vector>
#else
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace dapple {
inline namespace base {

namespace {
std::atomic<int> requested_threads{0};
}

int thread_count() {
  const int n = requested_threads.load();
  return n > 0 ? n : std::max(1u, std::thread::hardware_concurrency());
}

#ifdef DAPPLE_STD_THREADS

void set_thread_count(int threads) {
  requested_threads = threads;
}

void parallel_for(size_t n, const std::function<void(size_t)>& body) {
  // A nested loop runs on its caller: its outer loop already occupies the threads.
  thread_local bool inside = false;
  if (inside || thread_count() == 1 || n < 2) {
    for (size_t i = 0; i < n; ++i) body(i);
    return;
  }
  std::atomic<size_t> next{0};
  std::exception_ptr error;
  std::mutex mutex;
  const auto work = [&] {
    inside = true;
    for (size_t i; (i = next.fetch_add(1)) < n;) {
      try {
        body(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!error) error = std::current_exception();
        next = n;
      }
    }
    inside = false;
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < thread_count(); ++i) threads.emplace_back(work);
  work();
  for (std::thread& t : threads) t.join();
  if (error) std::rethrow_exception(error);
}

#else

namespace {
// An implicit arena has no more threads than processors, whatever the control allows.
struct Threads {
  explicit Threads(int n) : control(tbb::global_control::max_allowed_parallelism, n), arena(n) {}
  tbb::global_control control;
  tbb::task_arena arena;
};
std::unique_ptr<Threads> threads;
}  // namespace

void set_thread_count(int n) {
  requested_threads = n;
  threads.reset();
  if (n > 0) threads = std::make_unique<Threads>(n);
}

void parallel_for(size_t n, const std::function<void(size_t)>& body) {
  const auto loop = [&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, n, 1),
        [&](const tbb::blocked_range<size_t>& range) {
          for (size_t i = range.begin(); i != range.end(); ++i) body(i);
        },
        tbb::simple_partitioner());
  };
  if (threads)
    threads->arena.execute(loop);
  else
    loop();
}

#endif

void parallel_ranges(size_t n, size_t grain, const std::function<void(size_t, size_t)>& body) {
  const size_t chunks = (n + grain - 1) / grain;
  parallel_for(chunks, [&](size_t i) { body(i * grain, std::min(n, (i + 1) * grain)); });
}

}  // namespace base
}  // namespace dapple
