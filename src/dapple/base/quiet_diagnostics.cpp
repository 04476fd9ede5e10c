// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/quiet_diagnostics.h"

#include <mutex>
#include <set>

namespace dapple {
inline namespace base {

namespace {
struct Quiet {
  std::mutex mutex;
  std::multiset<const Diagnostics*> diagnostics;
};
Quiet& quiet() {
  static Quiet instance;
  return instance;
}
}  // namespace

QuietDiagnostics::QuietDiagnostics(const Diagnostics& diagnostics) : diagnostics_(&diagnostics) {
  const std::lock_guard lock(quiet().mutex);
  quiet().diagnostics.insert(diagnostics_);
}

QuietDiagnostics::~QuietDiagnostics() {
  const std::lock_guard lock(quiet().mutex);
  quiet().diagnostics.erase(quiet().diagnostics.find(diagnostics_));
}

bool QuietDiagnostics::is_quiet(const Diagnostics& diagnostics) {
  const std::lock_guard lock(quiet().mutex);
  return quiet().diagnostics.contains(&diagnostics);
}

}  // namespace base
}  // namespace dapple
