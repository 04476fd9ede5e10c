// SPDX-License-Identifier: Apache-2.0
#include "interrupts.h"

#include <pthread.h>
#include <semaphore.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/image/temporary_folder.h"

namespace dapple::app {

namespace {

constexpr int signals[] = {SIGINT, SIGTERM, SIGHUP};
constexpr auto grace = std::chrono::milliseconds(400);  // of the second in which an interrupted program is to end

// All that the handler touches.
std::atomic<bool> interrupted{false};
std::atomic<const char*> signal_note{nullptr};  // what the first signal is answered with
std::atomic<bool> keeps_hangup{false};
sem_t arrived;

extern "C" void on_signal(int) {
  const int error = errno;
  interrupted = true;
  for (const int s : signals)
    if (s != SIGHUP || !keeps_hangup) std::signal(s, SIG_DFL);
  const char* const note = signal_note;
  if (note && write(STDERR_FILENO, note, std::strlen(note)) < 0) errno = error;
  sem_post(&arrived);
  errno = error;
}

}  // namespace

Interrupts::Interrupts(bool quiet) {
  // The progress bar of a terminal makes room.
  static const std::string note = std::string(isatty(STDERR_FILENO) ? "\r\033[K" : "") +
                                  "interrupted: finishing what is under way; once more stops at once\n";
  if (!quiet) signal_note = note.c_str();
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

void Interrupts::begin_rendering() {
  Phase expected = Phase::set_up;
  if (!phase_.compare_exchange_strong(expected, Phase::rendering)) watcher_.join();  // which ends the program
}

const std::atomic<bool>& Interrupts::flag() const { return interrupted; }

void Interrupts::watch() {
  while (sem_wait(&arrived) != 0) {
  }
  Phase expected = Phase::set_up;
  if (interrupted && phase_.compare_exchange_strong(expected, Phase::ended)) {
    image::TemporaryFolder::remove_of_process();
    log_warning("interrupted before rendering began: there is no image");
    std::_Exit(static_cast<int>(ExitCode::interrupted));
  }
  std::this_thread::sleep_for(phase_ == Phase::rendering ? grace : std::chrono::milliseconds(0));
  abandon_ = true;
}

}  // namespace dapple::app
