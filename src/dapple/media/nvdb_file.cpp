// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/nvdb_file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>

namespace dapple::media {
namespace {

constexpr size_t header_size = 16, meta_size = 176, grid_header_size = 672;
constexpr size_t longest_name = 4096;
constexpr uint32_t version = 32, float_type = 1, unknown_class = 0, level_set = 1, fog_volume = 2;
constexpr std::array<const char*, 20> type_names = {"unknown", "float", "double", "int16",  "int32", "int64", "Vec3f",
                                                    "Vec3d",   "mask",  "half",   "uint32", "bool",  "RGBA8", "Fp4",
                                                    "Fp8",     "Fp16",  "FpN",    "Vec4f",  "Vec4d", "index"};

[[noreturn]] void fail(const std::string& what, size_t place) {
  throw std::runtime_error(what + ", at byte " + std::to_string(place));
}

template <class T>
T get(std::string_view bytes, size_t place) {
  T value;
  if (place > bytes.size() || bytes.size() - place < sizeof value) fail("it ends too early", bytes.size());
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

// '0' up to version 32.5; since then files say '2', bare grids '1'.
bool is_magic(std::string_view bytes, size_t place, std::string_view kinds) {
  return bytes.size() - place >= 8 && bytes.substr(place, 7) == "NanoVDB" &&
         kinds.find(bytes[place + 7]) != std::string_view::npos;
}

void check_kind(uint32_t type, uint32_t grid_class) {
  if (type != float_type)
    throw std::runtime_error(std::string("has values of type ") +
                             (type < type_names.size() ? type_names[type] : std::to_string(type)) + "; expected float");
  if (grid_class != unknown_class && grid_class != fog_volume)
    throw std::runtime_error("is " +
                             (grid_class == level_set ? "a level set" : "of class " + std::to_string(grid_class)) +
                             "; expected a fog volume");
}

void check_version(uint32_t stored, size_t place) {
  if (stored >> 21 != version)
    fail("NanoVDB version " + std::to_string(stored >> 21) + " cannot be read, only " + std::to_string(version), place);
}

}  // namespace

NvdbFile::NvdbFile(std::string_view bytes, bool mapped) : mapped_(mapped) {
  if (bytes.size() < header_size || !is_magic(bytes, 0, "012"))
    throw std::runtime_error("it is no NanoVDB file; expected \"NanoVDB\" at its beginning");
  if (is_magic(bytes, 0, "1")) throw std::runtime_error("it is a bare grid; expected a NanoVDB file with its header");
  for (size_t place = 0; place < bytes.size();) place = read_segment(bytes, place);
}

size_t NvdbFile::read_segment(std::string_view bytes, size_t place) {
  if (!is_magic(bytes, place, "02")) fail("expected \"NanoVDB\"", place);
  check_version(get<uint32_t>(bytes, place + 8), place + 8);
  const auto count = get<uint16_t>(bytes, place + 12), codec = get<uint16_t>(bytes, place + 14);
  if (codec > uint16_t(NvdbCodec::blosc))
    fail("its codec is number " + std::to_string(codec) + "; expected none, zip or blosc (0 to 2)", place + 14);
  place += header_size;
  const size_t first = entries_.size();
  std::vector<uint64_t> stored;
  for (int i = 0; i < count; ++i) {
    Entry e;
    e.size = get<uint64_t>(bytes, place);
    stored.push_back(get<uint64_t>(bytes, place + 8));
    e.type = get<uint32_t>(bytes, place + 32);
    e.grid_class = get<uint32_t>(bytes, place + 36);
    e.codec = NvdbCodec(codec);
    const auto length = get<uint32_t>(bytes, place + 136);
    if (place + meta_size > bytes.size()) fail("it ends too early", bytes.size());
    if (length > longest_name || length > bytes.size() - place - meta_size)
      fail("the name of a grid has " + std::to_string(length) + " bytes", place + 136);
    const std::string_view name = bytes.substr(place + meta_size, length);
    e.name = std::string(name.substr(0, name.find('\0')));
    place += meta_size + length;
    entries_.push_back(std::move(e));
  }
  for (size_t i = 0; i < stored.size(); ++i) {
    Entry& e = entries_[first + i];
    if (stored[i] > bytes.size() - place)
      fail("grid \"" + e.name + "\" is said to take " + std::to_string(stored[i]) + " bytes; " +
               std::to_string(bytes.size() - place) + " are left",
           place);
    e.stored = bytes.substr(place, stored[i]);
    place += stored[i];
    if (e.codec == NvdbCodec::none && e.size != stored[i])
      fail("grid \"" + e.name + "\" has two sizes, " + std::to_string(e.size) + " and " + std::to_string(stored[i]),
           place);
  }
  return place;
}

const NvdbFile::Entry* NvdbFile::find(std::string_view name) const {
  const auto it = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.name == name; });
  return it == entries_.end() ? nullptr : &*it;
}

std::vector<std::string> NvdbFile::names() const {
  std::vector<std::string> names;
  for (const Entry& e : entries_) names.push_back(e.name);
  return names;
}

SparseGrid NvdbFile::read(std::string_view name, NvdbValues values) const {
  const Entry* entry = find(name);
  if (!entry) {
    std::string there;
    for (const Entry& e : entries_) there += (there.empty() ? "" : ", ") + e.name;
    throw std::runtime_error("it has no grid \"" + std::string(name) + "\"; it has: " + there.substr(0, 400));
  }
  const auto tree = [&](std::string_view grid, bool may_release) {
    if (grid.size() < grid_header_size || !is_magic(grid, 0, "01"))
      throw std::runtime_error("does not begin as a grid of NanoVDB");
    check_version(get<uint32_t>(grid, 16), 16);
    check_kind(get<uint32_t>(grid, 636), get<uint32_t>(grid, 632));
    return NvdbTree(grid, values, may_release).read();
  };
  try {
    check_kind(entry->type, entry->grid_class);  // before it is unpacked
    if (entry->codec == NvdbCodec::none) return tree(entry->stored, mapped_);
    const Pages pages = unpack(entry->stored, entry->codec, entry->size, mapped_);
    return tree(pages.view(), true);
  } catch (const std::runtime_error& e) {
    throw std::runtime_error("grid \"" + entry->name + "\" " + e.what());
  }
}

}  // namespace dapple::media
