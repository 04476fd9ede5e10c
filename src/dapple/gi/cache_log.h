// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "dapple/base/timer.h"

namespace dapple::gi {

/// What became of entries of the radiosity cache, those that were replaced included: for pictures of what the cache
/// did. One a thread at a time; merged in the end. Of more entries than `max_entries` those with the smaller keys are
/// kept: keys are hashes, so that is a fair sample of them.
class CacheLog {
 public:
  struct Use {
    uint64_t lookups = 0, fills = 0;
    double filled_at = 0;  ///< of the last fill; s
  };
  static constexpr size_t max_entries = size_t(1) << 20;  ///< of about 70 bytes

  explicit CacheLog(const Timer& clock, size_t capacity = max_entries) : clock_(clock), capacity_(capacity) {}
  double now() const { return clock_.seconds(); }

  /// A look-up of an entry; `filled`: it had to be computed, which ended at `now`.
  void add(uint64_t key, bool filled, double now);
  CacheLog& operator+=(const CacheLog& other);
  /// Null for entries that nobody looked up, and for those left out.
  const Use* find(uint64_t key) const;
  size_t size() const { return uses_.size(); }

 private:
  void keep_up_to(uint64_t limit);
  void make_room();

  Timer clock_;
  size_t capacity_;
  uint64_t limit_ = ~uint64_t(0);  ///< keys above are left out
  std::unordered_map<uint64_t, Use> uses_;
};

/// The logs of all threads. Their clock begins when this is made.
class CacheLogs {
 public:
  double now() const { return clock_.seconds(); }
  CacheLog* add();
  CacheLog merged() const;  ///< when no thread adds any more

 private:
  const Timer clock_;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<CacheLog>> logs_;
};

}  // namespace dapple::gi
