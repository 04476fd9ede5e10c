// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"

namespace dapple::scenefile {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType : uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Bytes of a value in a binary file.
size_t size_of(PlyType type);

struct PlyProperty {
  std::string_view name;
  PlyType type = PlyType::float32;  ///< of the value, or of a list's items
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list's length
};

struct PlyElement {
  std::string_view name;
  uint64_t count = 0;  ///< as the header claims: not to be trusted
  std::vector<PlyProperty> properties;

  bool has_lists() const;
  /// Bytes of a row in a binary file; its lists counted as empty.
  size_t min_row_bytes() const;
  /// Position among the properties, -1 if there is none of the name.
  int find(std::string_view property) const;
};

/// Header of a PLY file. Names point into the data it was read from.
struct PlyHeader {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
  size_t bytes = 0;    ///< the body begins here
  uint32_t lines = 0;  ///< the body's first line is the one after these
};

/// Where a PLY file is named in a scene (may be unknown) and the file itself, for messages.
struct PlyPlace {
  std::string_view file;
  FileLoc loc;

  /// Throws InputError at `loc` that names the file and, if it is not 0, the line in it.
  [[noreturn]] void fail(const std::string& message, uint32_t line = 0) const;
};

PlyHeader parse_ply_header(std::string_view data, const PlyPlace& place);

}  // namespace dapple::scenefile
