// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/obj_reader.h"

#include <charconv>
#include <cstring>

#include "dapple/scenefile/far_points.h"
#include "dapple/scenefile/file_source.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

class ObjParser {
 public:
  ObjParser(std::string_view data, std::string_view name, const FileLoc& loc)
      : next_(data.data()), end_(next_ + data.size()), name_(name), loc_(loc) {}

  ObjMesh parse() {
    const bool is_text = next_ == end_ || !std::memchr(next_, '\0', size_t(end_ - next_));
    bool is_known = false;
    while (next_ < end_) {
      const std::string_view keyword = word();
      const bool v = keyword == "v", vt = keyword == "vt", f = keyword == "f";
      if (v)
        read_position();
      else if (vt)
        read_uv();
      else if (f)
        read_face();
      is_known |= v || vt || f;
      skip_line();
    }
    mesh_.doubt = !is_text ? "it holds NUL bytes" : !is_known ? "it has no v, vt or f line" : nullptr;
    if (!exact_.empty()) mesh_.base = take_off_base(exact_, &mesh_.P);
    if (!has_uv_) {
      mesh_.uv.clear();
      mesh_.uv_indices.clear();
    } else if (lacks_uv_) {
      for (uint32_t& i : mesh_.uv_indices)
        if (i == no_uv) i = uint32_t(mesh_.uv.size());
      mesh_.uv.push_back(V2f(0, 0));
    }
    return std::move(mesh_);
  }

 private:
  static constexpr uint32_t no_uv = ~0u;

  std::vector<V3d> exact_;  ///< positions, where the first is far from the origin

  [[noreturn]] void fail(const std::string& message) const {
    if (loc_.file.empty()) throw InputError(FileLoc{name_, line_, 0}, message);
    throw InputError(loc_, FileLoc{name_, line_, 0}.to_string() + ": " + message);
  }

  // A backslash at the end of a line joins it to the next.
  bool continues() const {
    const char* p = next_ + 1;
    if (p < end_ && *p == '\r') ++p;
    return *next_ == '\\' && p < end_ && *p == '\n';
  }
  void skip_space() {
    for (; next_ < end_; ++next_) {
      if (continues()) {
        while (*next_ != '\n') ++next_;
        ++line_;
      } else if (!is_space(*next_)) {
        return;
      }
    }
  }
  // The next word on this line; empty at its end.
  std::string_view word() {
    skip_space();
    const char* const begin = next_;
    if (next_ < end_ && *next_ == '#') return {};
    while (next_ < end_ && !is_space(*next_) && *next_ != '\n' && !continues()) ++next_;
    return {begin, size_t(next_ - begin)};
  }
  void skip_line() {
    for (; next_ < end_ && *next_ != '\n'; ++next_)
      if (continues()) {
        while (*next_ != '\n') ++next_;
        ++line_;
      }
    if (next_ < end_) ++next_, ++line_;
  }

  float to_number(std::string_view text) const {
    float value = 0;
    const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
    const auto [stop, error] = std::from_chars(begin, text.data() + text.size(), value);
    const size_t e = text.find_first_of("eE");
    const bool underflow = error == std::errc::result_out_of_range && e != text.npos && text.substr(e + 1, 1) == "-";
    if ((error != std::errc() && !underflow) || stop != text.data() + text.size() || !std::isfinite(value))
      fail("expected a number, found " + in_quotes(text));
    return underflow ? 0 : value;
  }
  float number() {
    const std::string_view text = word();
    if (text.empty()) fail("the line ends too early; expected a number");
    return to_number(text);
  }
  void read_position() {
    V3f p;
    V3d exact;
    for (int k = 0; k < 3; ++k) {
      const std::string_view text = word();
      if (text.empty()) fail("the line ends too early; expected a number");
      p[k] = to_number(text);
      exact[k] = double(p[k]);
      if (std::abs(p[k]) >= float(nearest_far))
        std::from_chars(text.data() + (text.front() == '+'), text.data() + text.size(), exact[k]);
    }
    if (mesh_.P.size() == exact_.size() && (!exact_.empty() || may_be_far({&p.x, 3}))) exact_.push_back(exact);
    mesh_.P.push_back(p);
  }
  void read_uv() {
    const float u = number();
    const std::string_view v = word();
    mesh_.uv.push_back({u, v.empty() ? 0 : to_number(v)});
  }

  // Indices count from 1, or back from the last element so far.
  uint32_t index(std::string_view text, size_t count, const char* what) const {
    int64_t i = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), i);
    if (error != std::errc() || stop != text.data() + text.size())
      fail("expected the number of a " + std::string(what) + ", found " + in_quotes(text));
    const int64_t n = int64_t(count), from_zero = i < 0 ? n + i : i - 1;
    if (i == 0 || from_zero < 0 || from_zero >= n)
      fail("a face names " + std::string(what) + " " + std::to_string(i) + "; there are " + std::to_string(n) +
           " so far");
    return uint32_t(from_zero);
  }
  void read_face() {
    const size_t first = mesh_.indices.size();
    for (std::string_view corner = word(); !corner.empty(); corner = word()) {
      const size_t slash = corner.find('/');
      mesh_.indices.push_back(index(corner.substr(0, slash), mesh_.P.size(), "vertex"));
      std::string_view uv = slash == corner.npos ? std::string_view() : corner.substr(slash + 1);
      uv = uv.substr(0, uv.find('/'));
      (uv.empty() ? lacks_uv_ : has_uv_) = true;
      mesh_.uv_indices.push_back(uv.empty() ? no_uv : index(uv, mesh_.uv.size(), "texture vertex"));
    }
    const size_t n = mesh_.indices.size() - first;
    if (n >= 3) {
      mesh_.face_sizes.push_back(uint32_t(n));
      return;
    }
    ++mesh_.ignored_faces;
    mesh_.indices.resize(first);
    mesh_.uv_indices.resize(first);
  }

  const char* next_;
  const char* end_;
  std::string_view name_;
  FileLoc loc_;
  uint32_t line_ = 1;
  ObjMesh mesh_;
  bool has_uv_ = false, lacks_uv_ = false;
};

}  // namespace

ObjMesh parse_obj(std::string_view data, std::string_view name, const FileLoc& loc) {
  return ObjParser(data, name, loc).parse();
}

ObjMesh read_obj(const std::string& path, const FileLoc& loc) {
  const FileSource source(path, loc);
  return parse_obj(source.contents(), path, loc);
}

}  // namespace dapple::scenefile
