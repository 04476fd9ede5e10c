// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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

/// A placement as it is written: rows of the map in double.
using ExactPlacement = std::array<double, 12>;

/// Placements of an object in a file (.places), little-endian:
///   "dapple-places" and three zero bytes, u32 version (1), u32 zero, u64 placements, u64 chunks;
///   for each chunk double origin[3], u64 placements, for each float rows[3][4].
/// So a forest may reach over a country and each tree still stands to the millimetre. Chunks are read from the disk
/// block by block, so one that is cut while it is read is an InputError.
class PlacementFile {
 public:
  struct Chunk {
    V3d origin;
    uint64_t size;   ///< placements
    uint64_t begin;  ///< byte of the first
  };
  static constexpr size_t block = 4096;  ///< placements that are read together

  /// InputError at `loc`, naming file and byte, for what is damaged, foreign or of another version: all counts are
  /// checked against the file's size here, the numbers where they are used. A file of gzip is inflated.
  PlacementFile(const std::string& path, const FileLoc& loc);
  /// The same from memory, which must outlive it; `name` stands for the file in messages.
  PlacementFile(std::string_view bytes, const std::string& name, const FileLoc& loc);
  ~PlacementFile();
  PlacementFile(const PlacementFile&) = delete;
  PlacementFile& operator=(const PlacementFile&) = delete;

  uint64_t size() const { return size_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  /// Those of a chunk from `first` on, out.size() of them. InputError if the file has become shorter.
  void read(const Chunk& chunk, uint64_t first, std::span<PlacementRows> out) const;
  /// Calls visit(chunk, first, rows) for all, in order, at most `block` at once.
  template <class Visit>
  void for_each_block(const Visit& visit) const {
    std::vector<PlacementRows> rows;
    for (const Chunk& chunk : chunks_)
      for (uint64_t first = 0; first < chunk.size; first += block) {
        rows.resize(size_t(std::min<uint64_t>(block, chunk.size - first)));
        read(chunk, first, rows);
        visit(chunk, first, std::span<const PlacementRows>(rows));
      }
  }
  /// Some placements, spread over the file, but those of numbers that none may have.
  std::vector<ExactPlacement> sample() const;

 private:
  void parse();
  void read_bytes(uint64_t begin, size_t count, void* out) const;
  [[noreturn]] void fail(uint64_t byte, const std::string& what) const;
  friend class PlacementHeads;

  const std::string name_;
  const FileLoc loc_;
  int file_ = -1;  ///< or all is in memory:
  std::unique_ptr<const FileSource> inflated_;
  std::string_view memory_;
  uint64_t bytes_ = 0;
  std::vector<Chunk> chunks_;
  uint64_t size_ = 0;
};

/// A placement of a chunk with this origin.
ExactPlacement exact_placement(const PlacementRows& rows, const V3d& origin);

/// The bytes of a file of `placements`, in chunks of neighbours in that order.
std::string encode_placements(std::span<const ExactPlacement> placements);

/// Placements of a text, one a line: x y z, degrees of turn about z (0), scale (1), or the three rows of a map, 12
/// numbers. Empty lines and what follows a # are skipped. InputError names the line.
std::vector<ExactPlacement> parse_placement_text(std::string_view text, const std::string& name);

}  // namespace dapple::scenefile
