// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/placement_file.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>
#include <system_error>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

static_assert(std::endian::native == std::endian::little, "placements are read as they lie in memory");
static_assert(sizeof(PlacementRows) == 48);

constexpr char magic[16] = "dapple-places";
constexpr uint32_t version = 1;
constexpr size_t chunk_head = 3 * sizeof(double) + sizeof(uint64_t);
constexpr size_t written_together = 4096;
constexpr size_t sampled = 4096;
constexpr double farthest = 1e12;

template <class T>
void put(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

/// Reads heads one after the other, and skips what lies between them.
class PlacementHeads {
 public:
  explicit PlacementHeads(const PlacementFile& file) : file_(file) {}

  [[noreturn]] void fail(const std::string& what) const { file_.fail(at_, what); }
  uint64_t left() const { return file_.bytes_ - at_; }
  uint64_t at() const { return at_; }
  void skip(uint64_t n) { at_ += n; }
  template <class T>
  T get(const char* what) {
    T value;
    if (sizeof value > left()) fail(std::string("the file ends within ") + what);
    if (at_ < first_ || at_ + sizeof value > first_ + window_.size()) {
      first_ = at_;
      window_.resize(size_t(std::min<uint64_t>(left(), heads_together)));
      file_.read_bytes(first_, window_.size(), window_.data());
    }
    std::memcpy(&value, window_.data() + (at_ - first_), sizeof value);
    at_ += sizeof value;
    return value;
  }

 private:
  static constexpr size_t heads_together = 4096;  // bytes: chunks without placements come in great numbers too
  const PlacementFile& file_;
  uint64_t at_ = 0, first_ = 0;
  std::vector<char> window_;
};

ExactPlacement exact_placement(const PlacementRows& rows, const V3d& origin) {
  ExactPlacement out;
  for (size_t i = 0; i < 12; ++i) out[i] = double(rows[i]) + (i % 4 == 3 ? origin[int(i / 4)] : 0);
  return out;
}

PlacementFile::PlacementFile(const std::string& path, const FileLoc& loc) : name_(path), loc_(loc) {
  file_ = open_regular_file(path, loc, &bytes_);
  unsigned char head[2] = {};
  try {
    if (bytes_ >= sizeof head) read_bytes(0, sizeof head, head);
    if (head[0] == 0x1f && head[1] == 0x8b) {
      inflated_ = std::make_unique<const FileSource>(path, loc);
      memory_ = inflated_->contents(), bytes_ = memory_.size();
    }
    parse();
  } catch (...) {
    close(file_);
    throw;
  }
}

PlacementFile::PlacementFile(std::string_view bytes, const std::string& name, const FileLoc& loc)
    : name_(name), loc_(loc), memory_(bytes), bytes_(bytes.size()) {
  parse();
}

PlacementFile::~PlacementFile() {
  if (file_ >= 0) close(file_);
}

void PlacementFile::fail(uint64_t byte, const std::string& what) const {
  const std::string message = "byte " + std::to_string(byte) + ": " + what;
  if (loc_.file.empty()) throw InputError(FileLoc{name_, 0, 0}, message);
  throw InputError(loc_, name_ + ": " + message);
}

void PlacementFile::read_bytes(uint64_t begin, size_t count, void* out) const {
  if (file_ < 0 || inflated_) {
    std::memcpy(out, memory_.data() + begin, count);
    return;
  }
  for (size_t done = 0; done < count;) {
    const ssize_t got = pread(file_, static_cast<char*>(out) + done, count - done, off_t(begin + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(begin + done, std::generic_category().message(errno));
    if (got == 0) fail(begin + done, "the file has become shorter while it was read");
    done += size_t(got);
  }
}

void PlacementFile::read(const Chunk& chunk, uint64_t first, std::span<PlacementRows> out) const {
  read_bytes(chunk.begin + first * sizeof(PlacementRows), out.size_bytes(), out.data());
}

void PlacementFile::parse() {
  PlacementHeads in(*this);
  struct Magic {
    char text[sizeof magic];
  };
  if (bytes_ < sizeof magic || std::memcmp(in.get<Magic>("").text, magic, sizeof magic) != 0)
    in.fail("no placements; expected a file that `dapple places pack` wrote");
  if (const auto its_version = in.get<uint32_t>("the version"); its_version != version)
    in.fail("placements of version " + std::to_string(its_version) + "; this program reads version " +
            std::to_string(version));
  if (in.get<uint32_t>("the head") != 0) in.fail("expected zero after the version");
  size_ = in.get<uint64_t>("the number of placements");
  const auto chunks = in.get<uint64_t>("the number of chunks");
  if (size_ > in.left() / sizeof(PlacementRows)) in.fail("fewer placements than the file says");
  if (chunks > in.left() / chunk_head) in.fail("fewer chunks than the file says");
  uint64_t found = 0;
  for (uint64_t c = 0; c < chunks; ++c) {
    Chunk chunk;
    for (int k = 0; k < 3; ++k) {
      chunk.origin[k] = in.get<double>("a chunk's origin");
      if (!(std::abs(chunk.origin[k]) <= farthest)) in.fail("a chunk's origin is no number up to 1e12");
    }
    chunk.size = in.get<uint64_t>("a chunk's number of placements");
    if (chunk.size > in.left() / sizeof(PlacementRows)) in.fail("fewer placements in a chunk than it says");
    chunk.begin = in.at();
    in.skip(chunk.size * sizeof(PlacementRows));
    found += chunk.size;
    chunks_.push_back(chunk);
  }
  if (found != size_)
    in.fail("chunks hold " + std::to_string(found) + " placements, the head says " + std::to_string(size_));
  if (in.left() > 0) in.fail("more bytes than chunks hold");
}

std::vector<ExactPlacement> PlacementFile::sample() const {
  std::vector<ExactPlacement> out;
  const uint64_t step = std::max<uint64_t>(size_ / sampled, 1);
  uint64_t next = 0;  // from the chunk's first
  for (const Chunk& chunk : chunks_) {
    for (; next < chunk.size; next += step) {
      PlacementRows rows;
      read(chunk, next, {&rows, 1});
      const ExactPlacement m = exact_placement(rows, chunk.origin);
      if (std::all_of(m.begin(), m.end(), [](double x) { return std::abs(x) <= farthest; })) out.push_back(m);
    }
    next -= chunk.size;
  }
  return out;
}

std::string encode_placements(std::span<const ExactPlacement> placements) {
  std::string out;
  const uint64_t chunks = (placements.size() + written_together - 1) / written_together;
  out.reserve(40 + chunks * chunk_head + placements.size() * sizeof(PlacementRows));
  put(magic, &out);
  put(version, &out), put(uint32_t(0), &out);
  put(uint64_t(placements.size()), &out), put(chunks, &out);
  for (size_t first = 0; first < placements.size(); first += written_together) {
    const auto chunk = placements.subspan(first, std::min(written_together, placements.size() - first));
    Imath::Box3d box;
    for (const ExactPlacement& m : chunk) box.extendBy(V3d(m[3], m[7], m[11]));
    V3d origin = box.center();
    for (int k = 0; k < 3; ++k) origin[k] = std::round(origin[k]), put(origin[k], &out);
    put(uint64_t(chunk.size()), &out);
    for (const ExactPlacement& m : chunk)
      for (size_t i = 0; i < 12; ++i) put(float(i % 4 == 3 ? m[i] - origin[int(i / 4)] : m[i]), &out);
  }
  return out;
}

std::vector<ExactPlacement> parse_placement_text(std::string_view text, const std::string& name) {
  std::vector<ExactPlacement> out;
  for (uint32_t number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = line.substr(0, line.find('#'));
    const auto fail = [&](const std::string& message) { throw InputError(FileLoc{name, number, 0}, message); };
    double x[13];
    size_t n = 0;
    for (;;) {
      line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
      if (line.empty()) break;
      const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
      line.remove_prefix(word.size());
      const auto [stop, problem] = std::from_chars(word.data(), word.data() + word.size(), x[n]);
      if (problem != std::errc() || stop != word.data() + word.size() || !(std::abs(x[n]) <= farthest))
        fail("found " + in_quotes(word) + ", expected a number up to 1e12");
      if (++n > 12) break;
    }
    if (n == 0) continue;
    if (n == 12) {
      ExactPlacement m;
      std::copy_n(x, 12, m.begin());
      out.push_back(m);
      continue;
    }
    if (n < 3 || n > 5)
      fail(std::to_string(n) +
           " numbers; expected x y z, with a turn in degrees and a scale or without, or 12 of a map");
    const double turn = n > 3 ? x[3] * std::numbers::pi / 180 : 0, scale = n > 4 ? x[4] : 1;
    if (scale == 0) fail("the scale is 0");
    const double c = scale * std::cos(turn), s = scale * std::sin(turn);
    out.push_back({c, -s, 0, x[0], s, c, 0, x[1], 0, 0, scale, x[2]});
  }
  return out;
}

}  // namespace dapple::scenefile
