// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <new>

namespace dapple::modelfile {

namespace {

constexpr int out_of_memory_code = 77;

uint64_t mapped_bytes() {
  unsigned long long pages = 0;
  if (FILE* f = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(f, "%llu", &pages) != 1) pages = 0;
    std::fclose(f);
  }
  return uint64_t(pages) * uint64_t(sysconf(_SC_PAGESIZE));
}

void limit(__rlimit_resource what, uint64_t value) {
  rlimit r{};
  if (getrlimit(what, &r) != 0) return;
  if (r.rlim_max != RLIM_INFINITY && r.rlim_max < value) value = r.rlim_max;
  r.rlim_cur = r.rlim_max = value;
  setrlimit(what, &r);
}

void write_all(int fd, const char* data, size_t size) {
  while (size > 0) {
    const ssize_t n = write(fd, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) _exit(1);
    data += n;
    size -= size_t(n);
  }
}

// In the child, before any work.
void confine(const ChildLimits& limits, uint64_t mapped, pid_t parent) {
  for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ, SIGXCPU, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL})
    signal(s, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  if (const int null = open("/dev/null", O_RDWR); null >= 0)
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(null, fd);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  limit(RLIMIT_CPU, uint64_t(std::ceil(limits.seconds)));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  limit(RLIMIT_AS, mapped + limits.memory_bytes);
#else
  (void)mapped;
#endif
  std::set_new_handler([] { _exit(out_of_memory_code); });
}

[[noreturn]] void run_child(const std::function<std::string()>& work, int fd) {
  char mark = 'E';
  std::string result;
  try {
    result = work();
    mark = 'M';
  } catch (const std::bad_alloc&) {
    _exit(out_of_memory_code);
  } catch (const std::exception& e) {
    result = e.what();
  } catch (...) {
    result = "an unknown exception";
  }
  write_all(fd, &mark, 1);
  write_all(fd, result.data(), result.size());
  _exit(0);
}

// Everything up to the end of the pipe, or until time or size is over: then false.
enum class Reading { whole, too_late, too_large };
Reading read_all(int fd, double seconds, uint64_t most, std::string* out) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  std::string block(size_t(1) << 20, '\0');
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return Reading::too_late;
    pollfd p{fd, POLLIN, 0};
    if (poll(&p, 1, int(std::min<int64_t>(left, 1000))) <= 0) continue;
    const ssize_t n = read(fd, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Reading::whole;
    if (out->size() + size_t(n) > most) return Reading::too_large;
    out->append(block.data(), size_t(n));
  }
}

std::string whole_number(double x) {
  return std::to_string(int64_t(std::llround(x)));
}

}  // namespace

std::string run_in_child(const std::function<std::string()>& work, const ChildLimits& limits) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw ChildFailure(std::string("there is no pipe: ") + std::strerror(errno));
  const uint64_t mapped = mapped_bytes();
  const pid_t parent = getpid(), child = fork();
  if (child < 0) {
    const int error = errno;
    close(ends[0]), close(ends[1]);
    throw ChildFailure(std::string("no process could be started: ") + std::strerror(error));
  }
  if (child == 0) {
    close(ends[0]);
    confine(limits, mapped, parent);
    run_child(work, ends[1]);
  }
  close(ends[1]);
  std::string result;
  Reading reading = Reading::too_large;
  std::exception_ptr error;
  try {
    reading = read_all(ends[0], 4 * limits.seconds, limits.result_bytes, &result);
  } catch (...) {
    error = std::current_exception();
  }
  close(ends[0]);
  if (reading != Reading::whole) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (error) std::rethrow_exception(error);
  const std::string time = "it took more than " + whole_number(limits.seconds) + " s";
  if (reading == Reading::too_late) throw ChildFailure(time);
  if (reading == Reading::too_large)
    throw ChildFailure("it has more than " + whole_number(double(limits.result_bytes) / 1e6) + " MB of data");
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) throw ChildFailure(time);
  if (WIFSIGNALED(status)) throw ChildFailure(std::string("its reader crashed (") + strsignal(WTERMSIG(status)) + ")");
  if (WIFEXITED(status) && WEXITSTATUS(status) == out_of_memory_code)
    throw ChildFailure("it took more than " + whole_number(double(limits.memory_bytes) / 1e6) + " MB of memory");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || result.empty()) throw ChildFailure("its reader gave up");
  if (result[0] == 'E') throw std::runtime_error(result.substr(1));
  result.erase(0, 1);
  return result;
}

}  // namespace dapple::modelfile
