// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace dapple {
inline namespace base {

inline constexpr int most_threads = 1024;
/// Threads for parallel loops, most_threads at most: 0 = all processors. Affects loops started afterwards. Call from
/// the main thread.
void set_thread_count(int threads);
int thread_count();

/// Calls body(i) for i in [0, n), each once, in any order, on thread_count() threads. An exception from a body
/// is rethrown here (one of them, if several). Loops nest. oneTBB, or std::thread in the tsan preset.
void parallel_for(size_t n, const std::function<void(size_t)>& body);

/// Calls body(begin, end) on disjoint ranges of at most `grain` that cover [0, n).
void parallel_ranges(size_t n, size_t grain, const std::function<void(size_t, size_t)>& body);

}  // namespace base
}  // namespace dapple
