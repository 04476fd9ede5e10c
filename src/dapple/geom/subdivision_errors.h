// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::geom {

/// What OpenSubdiv complains about on this thread while the object lives. OpenSubdiv reports through functions of the
/// whole program and would print.
class SubdivisionErrors {
 public:
  SubdivisionErrors();
  /// Throws std::invalid_argument that says why the mesh cannot be subdivided.
  [[noreturn]] void fail() const;
};

}  // namespace dapple::geom
