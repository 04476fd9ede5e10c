// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/subdivision_errors.h"

#include <opensubdiv/far/error.h>

#include <mutex>
#include <stdexcept>
#include <string>

namespace dapple::geom {

namespace {

namespace Far = OpenSubdiv::Far;

thread_local std::string last_error;
void keep_error(Far::ErrorType, const char* message) {
  last_error = message;
}
void ignore_warning(const char*) {}

}  // namespace

SubdivisionErrors::SubdivisionErrors() {
  static std::once_flag once;
  std::call_once(once, [] {
    Far::SetErrorCallback(keep_error);
    Far::SetWarningCallback(ignore_warning);
  });
  last_error.clear();
}

void SubdivisionErrors::fail() const {
  // "Failure in TopologyRefinerFactory<>::Create() -- vertex with valence 70000 > 65535 max.\n" names no function of
  // ours.
  if (const size_t where = last_error.find(" -- "); where != std::string::npos) last_error.erase(0, where + 4);
  while (!last_error.empty() && (last_error.back() == '\n' || last_error.back() == '.')) last_error.pop_back();
  throw std::invalid_argument("the mesh cannot be subdivided" + (last_error.empty() ? "" : ": " + last_error));
}

}  // namespace dapple::geom
