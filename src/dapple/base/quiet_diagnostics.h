// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/error.h"

namespace dapple {
inline namespace base {

/// While it lives, warnings of one Diagnostics are collected and not logged, whichever thread gives them. Those of
/// others are logged as ever. Thread-safe.
class QuietDiagnostics {
 public:
  explicit QuietDiagnostics(const Diagnostics& diagnostics);
  ~QuietDiagnostics();
  QuietDiagnostics(const QuietDiagnostics&) = delete;
  QuietDiagnostics& operator=(const QuietDiagnostics&) = delete;

  static bool is_quiet(const Diagnostics& diagnostics);

 private:
  const Diagnostics* diagnostics_;
};

}  // namespace base
}  // namespace dapple
