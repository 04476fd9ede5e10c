// SPDX-License-Identifier: Apache-2.0
#include "interrupts.h"

#include <semaphore.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/image/atomic_file.h"
#include "dapple/image/temporary_folder.h"

namespace dapple::app {

namespace {

constexpr int signals[] = {SIGINT, SIGTERM, SIGHUP};
constexpr long grace_ns = 400'000'000;  // of the second in which an interrupted program is to end

// All that the handler touches.
std::atomic<bool> interrupted{false};
std::atomic<int> second_signal{0};
std::atomic<bool> keeps_hangup{false};
sem_t arrived;

extern "C" void on_signal(int s) {
  const int error = errno;
  if (interrupted.exchange(true)) {
    second_signal = s;
    for (const int each : signals)
      if (each != SIGHUP || !keeps_hangup) std::signal(each, SIG_DFL);
  }
  sem_post(&arrived);
  errno = error;
}

void wait_for_signal() {
  while (sem_wait(&arrived) != 0) {
  }
}

void wait_for_signal(long most_ns) {
  timespec until{};
  clock_gettime(CLOCK_MONOTONIC, &until);
  until.tv_nsec += most_ns;
  until.tv_sec += until.tv_nsec / 1'000'000'000;
  until.tv_nsec %= 1'000'000'000;
  while (sem_clockwait(&arrived, CLOCK_MONOTONIC, &until) != 0 && errno == EINTR) {
  }
}

}  // namespace

Interrupts::Interrupts(std::string result, bool quiet) : result_(std::move(result)), quiet_(quiet) {
  sem_init(&arrived, 0, 0);
  watcher_ = std::thread([this] { watch(); });
  struct sigaction old {};
  sigaction(SIGHUP, nullptr, &old);
  keeps_hangup = old.sa_handler == SIG_IGN;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  for (const int s : signals)
    if (s != SIGHUP || !keeps_hangup) sigaction(s, &action, nullptr);
}

Interrupts::~Interrupts() {
  // An interrupt may be about to end the program: it then does so with its own exit code.
  Phase now = phase_;
  while (now != Phase::ended && !phase_.compare_exchange_weak(now, Phase::ended)) {
  }
  sem_post(&arrived);
  watcher_.join();
}

bool Interrupts::take_from_work(Phase to) {
  Phase expected = Phase::working;
  return phase_.compare_exchange_strong(expected, to);
}

void Interrupts::begin_rendering() {
  if (!take_from_work(Phase::rendering)) watcher_.join();  // which ends the program
}

void Interrupts::begin_writing(std::vector<std::string> paths) {
  std::erase(paths, "");
  {
    const std::lock_guard lock(mutex_);
    paths_ = std::move(paths);
  }
  if (phase_ == Phase::rendering)
    phase_ = Phase::writing;
  else if (!take_from_work(Phase::writing))
    watcher_.join();
}

void Interrupts::end_writing() {
  {
    const std::lock_guard lock(mutex_);
    written_ += int(paths_.size());
    paths_.clear();
  }
  phase_ = Phase::working;
  if (!interrupted) return;
  if (!take_from_work(Phase::ended)) watcher_.join();
  end_program();
}

const std::atomic<bool>& Interrupts::flag() const {
  return interrupted;
}

void Interrupts::end_program() const {
  image::TemporaryFolder::remove_of_process();
  log_warning(std::string("interrupted") + (written_ > 0 ? ": the files written before are whole, others are not there"
                                                         : ": there is no " + result_));
  std::_Exit(static_cast<int>(ExitCode::interrupted));
}

void Interrupts::remove_parts() {
  const std::lock_guard lock(mutex_);
  for (const std::string& path : paths_) image::AtomicFile::remove_parts_of_process(path);
}

void Interrupts::watch() {
  wait_for_signal();
  if (!interrupted) return;
  if (take_from_work(Phase::ended)) end_program();
  if (!quiet_ && phase_ != Phase::ended)  // the progress bar of a terminal makes room
    std::fprintf(stderr, "%sinterrupted: finishing what is under way; once more stops at once\n",
                 isatty(STDERR_FILENO) ? "\r\033[K" : "");
  if (phase_ == Phase::rendering) wait_for_signal(grace_ns);
  abandon_ = true;
  while (phase_ != Phase::ended && second_signal == 0) wait_for_signal();
  if (second_signal == 0) return;
  image::TemporaryFolder::remove_of_process();
  remove_parts();
  kill(getpid(), second_signal);
}

}  // namespace dapple::app
