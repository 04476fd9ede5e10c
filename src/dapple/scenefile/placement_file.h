// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"
#include "dapple/scenefile/file_source.h"

namespace dapple::scenefile {

/// Places of an object: rows of a map from its space. Translations are less the origin of the chunk.
using PlacementRows = std::array<float, 12>;

/// Placements of an object in a file (.places), little-endian:
///   "dapple-places" and three zero bytes, u32 version (1), u32 zero, u64 placements, u64 chunks;
///   for each chunk double origin[3], u64 placements, for each float rows[3][4].
/// So a forest may reach over a country and each tree still stands to the millimetre. Files are mapped, and read chunk
/// by chunk.
class PlacementFile {
 public:
  struct Chunk {
    V3d origin;
    std::span<const std::byte> rows;
    size_t size() const { return rows.size() / sizeof(PlacementRows); }
    PlacementRows operator[](size_t i) const;
  };

  /// InputError at `loc`, naming file and byte, for what is damaged, foreign or of another version: all counts are
  /// checked against the file's size here, the numbers where they are used.
  PlacementFile(const std::string& path, const FileLoc& loc);
  /// The same from memory, which must outlive it; `name` stands for the file in messages.
  PlacementFile(std::string_view bytes, const std::string& name, const FileLoc& loc);

  uint64_t size() const { return size_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  /// A chunk has been read: the system may have its pages back.
  void drop(const Chunk& chunk) const;
  /// Of the origins of some placements, spread over the file.
  std::vector<V3d> sample() const;

 private:
  void parse(std::string_view bytes, const std::string& name, const FileLoc& loc);

  std::unique_ptr<const FileSource> file_;
  std::vector<Chunk> chunks_;
  uint64_t size_ = 0;
};

/// A placement as it is written: rows of the map in double.
using ExactPlacement = std::array<double, 12>;

/// The bytes of a file of `placements`, in chunks of neighbours in that order.
std::string encode_placements(std::span<const ExactPlacement> placements);

/// Placements of a text, one a line: x y z, degrees of turn about z (0), scale (1), or the three rows of a map, 12
/// numbers. Empty lines and what follows a # are skipped. InputError names the line.
std::vector<ExactPlacement> parse_placement_text(std::string_view text, const std::string& name);

}  // namespace dapple::scenefile
