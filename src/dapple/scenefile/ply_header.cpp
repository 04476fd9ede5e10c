// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/ply_header.h"

#include <array>
#include <charconv>
#include <optional>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

struct TypeName {
  std::string_view name;
  PlyType type;
};

constexpr std::array type_names = {
    TypeName{"char", PlyType::int8},       TypeName{"uchar", PlyType::uint8},    TypeName{"short", PlyType::int16},
    TypeName{"ushort", PlyType::uint16},   TypeName{"int", PlyType::int32},      TypeName{"uint", PlyType::uint32},
    TypeName{"float", PlyType::float32},   TypeName{"double", PlyType::float64}, TypeName{"int8", PlyType::int8},
    TypeName{"uint8", PlyType::uint8},     TypeName{"int16", PlyType::int16},    TypeName{"uint16", PlyType::uint16},
    TypeName{"int32", PlyType::int32},     TypeName{"uint32", PlyType::uint32},  TypeName{"float32", PlyType::float32},
    TypeName{"float64", PlyType::float64},
};

class HeaderParser {
 public:
  HeaderParser(std::string_view data, const PlyPlace& place) : data_(data), place_(place) {}

  PlyHeader parse() {
    if (data_.substr(0, 3) != "ply" || !next_line() || word(0) != "ply")
      place_.fail("it is not a PLY file: expected \"ply\" in the first line", 1);
    bool has_format = false;
    for (;;) {
      if (!next_line()) fail("the header does not end: expected \"end_header\"");
      if (words_.empty() || word(0) == "comment" || word(0) == "obj_info") continue;
      if (word(0) == "end_header") break;
      if (word(0) == "format") {
        has_format = parse_format();
      } else if (word(0) == "element") {
        parse_element();
      } else if (word(0) == "property") {
        parse_property();
      } else {
        fail("unknown word " + in_quotes(word(0)) + " in the header");
      }
    }
    if (!has_format) fail("the header names no format");
    header_.bytes = next_;
    header_.lines = line_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { place_.fail(message, line_); }

  std::string_view word(size_t i) const { return i < words_.size() ? words_[i] : std::string_view(); }

  bool next_line() {
    if (next_ >= data_.size()) return false;
    ++line_;
    const size_t end = std::min(data_.find('\n', next_), data_.size());
    const std::string_view line = data_.substr(next_, end - next_);
    next_ = std::min(end + 1, data_.size());
    words_.clear();
    constexpr size_t max_words = 6;  // more are of no use to any line but a comment
    for (size_t i = 0; words_.size() < max_words;) {
      i = line.find_first_not_of(" \t\r", i);
      if (i == std::string_view::npos) break;
      const size_t stop = std::min(line.find_first_of(" \t\r", i), line.size());
      words_.push_back(line.substr(i, stop - i));
      i = stop;
    }
    return true;
  }

  bool parse_format() {
    if (word(1) == "ascii") {
      header_.format = PlyFormat::ascii;
    } else if (word(1) == "binary_little_endian") {
      header_.format = PlyFormat::binary_little_endian;
    } else if (word(1) == "binary_big_endian") {
      header_.format = PlyFormat::binary_big_endian;
    } else {
      fail("unknown format " + in_quotes(word(1)) + "; " +
           one_of({"ascii", "binary_little_endian", "binary_big_endian"}));
    }
    return true;
  }

  void parse_element() {
    PlyElement element;
    element.name = word(1);
    const std::string_view count = word(2);
    const auto [stop, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (words_.size() != 3 || error != std::errc() || stop != count.data() + count.size())
      fail("element " + in_quotes(element.name) + ": expected a whole number of rows, found " + in_quotes(count));
    header_.elements.push_back(std::move(element));
  }

  PlyType type_of(std::string_view name) const {
    std::vector<std::string_view> names;
    for (const TypeName& t : type_names) {
      if (t.name == name) return t.type;
      names.push_back(t.name);
    }
    fail("unknown property type " + in_quotes(name) + "; " + one_of(names));
  }

  void parse_property() {
    if (header_.elements.empty()) fail("a property stands before the first element");
    PlyProperty p;
    p.is_list = word(1) == "list";
    const size_t type = p.is_list ? 3 : 1;
    if (words_.size() != type + 2) fail("expected \"property type name\" or \"property list type type name\"");
    if (p.is_list) p.count_type = type_of(word(2));
    if (p.is_list && size_of(p.count_type) == 8) fail("the length of a list must not be of type \"double\"");
    p.type = type_of(word(type));
    p.name = word(type + 1);
    header_.elements.back().properties.push_back(p);
  }

  std::string_view data_;
  const PlyPlace& place_;
  PlyHeader header_;
  std::vector<std::string_view> words_;
  size_t next_ = 0;
  uint32_t line_ = 0;
};

}  // namespace

size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  return 0;
}

bool PlyElement::has_lists() const {
  for (const PlyProperty& p : properties)
    if (p.is_list) return true;
  return false;
}

size_t PlyElement::min_row_bytes() const {
  size_t bytes = 0;
  for (const PlyProperty& p : properties) bytes += size_of(p.is_list ? p.count_type : p.type);
  return bytes;
}

int PlyElement::find(std::string_view property) const {
  for (size_t i = 0; i < properties.size(); ++i)
    if (properties[i].name == property) return int(i);
  return -1;
}

void PlyPlace::fail(const std::string& message, uint32_t line) const {
  if (loc.file.empty()) throw InputError(FileLoc{file, line, 0}, message);
  throw InputError(loc, FileLoc{file, line, 0}.to_string() + ": " + message);
}

PlyHeader parse_ply_header(std::string_view data, const PlyPlace& place) {
  return HeaderParser(data, place).parse();
}

}  // namespace dapple::scenefile
