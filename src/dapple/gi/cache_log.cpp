// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/cache_log.h"

#include <algorithm>

namespace dapple::gi {

void CacheLog::add(uint64_t key, bool filled, double now) {
  if (key > limit_) return;
  Use& use = uses_[key];
  ++use.lookups;
  if (filled) ++use.fills, use.filled_at = now;
  make_room();
}

CacheLog& CacheLog::operator+=(const CacheLog& other) {
  keep_up_to(std::min(limit_, other.limit_));
  for (const auto& [key, from] : other.uses_) {
    if (key > limit_) continue;
    Use& use = uses_[key];
    use.lookups += from.lookups;
    use.fills += from.fills;
    use.filled_at = std::max(use.filled_at, from.filled_at);
  }
  make_room();
  return *this;
}

const CacheLog::Use* CacheLog::find(uint64_t key) const {
  const auto found = uses_.find(key);
  return found == uses_.end() ? nullptr : &found->second;
}

void CacheLog::make_room() {
  while (uses_.size() > capacity_) keep_up_to(limit_ / 2);
}

void CacheLog::keep_up_to(uint64_t limit) {
  if (limit == limit_) return;
  limit_ = limit;
  std::erase_if(uses_, [limit](const auto& use) { return use.first > limit; });
}

CacheLog* CacheLogs::add() {
  const std::lock_guard lock(mutex_);
  return logs_.emplace_back(std::make_unique<CacheLog>(clock_)).get();
}

CacheLog CacheLogs::merged() const {
  const std::lock_guard lock(mutex_);
  CacheLog all(clock_);
  for (const auto& log : logs_) all += *log;
  return all;
}

}  // namespace dapple::gi
