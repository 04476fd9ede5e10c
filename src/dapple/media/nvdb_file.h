// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dapple/media/nvdb_bytes.h"
#include "dapple/media/nvdb_tree.h"
#include "dapple/media/sparse_grid.h"

namespace dapple::media {

/// The grids of a NanoVDB file, format version 32 (OpenVDB 9 to 12). Nothing that the file says is trusted: offsets and
/// counts are checked before they are used, and memory is at most in proportion to the file. Errors are
/// std::runtime_error with the place in the file.
class NvdbFile {
 public:
  /// `bytes`: the file; must outlive this. `mapped`: they are a mapped file, whose pages may be given back while a grid
  /// is read, so that grid and file do not stand in memory together.
  NvdbFile(std::string_view bytes, bool mapped);

  bool has(std::string_view name) const { return find(name) != nullptr; }
  std::vector<std::string> names() const;
  /// The grid of this name, the first if there are more. It must be there, of single-precision floats, and a fog volume
  /// or of unknown class.
  SparseGrid read(std::string_view name, NvdbValues values) const;

 private:
  struct Entry {
    std::string name;
    uint64_t size;  // unpacked
    std::string_view stored;
    uint32_t type, grid_class;
    NvdbCodec codec;
  };
  const Entry* find(std::string_view name) const;
  size_t read_segment(std::string_view bytes, size_t place);

  std::vector<Entry> entries_;
  bool mapped_;
};

}  // namespace dapple::media
