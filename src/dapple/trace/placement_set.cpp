// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/placement_set.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple::trace {

namespace {

constexpr int key_bits = 32;
constexpr float rounding = 0x1p-21f;

/// Halves a box along its longest side, bit by bit: the number of the last half in which a point lies.
class Curve {
 public:
  explicit Curve(const Box3f& box) : least_(box.min) {
    V3f size = box.max - box.min;
    int bits[3] = {};
    for (int bit = 0; bit < key_bits; ++bit) {
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      axes_[bit] = axis;
      ++bits[axis];
      size[axis] /= 2;
    }
    for (int k = 0; k < 3; ++k) {
      const float extent = box.max[k] - box.min[k];
      most_[k] = std::ldexp(1.0f, bits[k]);
      cells_[k] = extent > 1e-20f ? most_[k] / extent : 0;
      top_[k] = bits[k] - 1;
    }
  }

  uint32_t key(const V3f& p) const {
    uint64_t at[3];
    int bit[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = uint64_t(std::clamp((p[k] - least_[k]) * cells_[k], 0.0f, most_[k]));
      at[k] = std::min(at[k], uint64_t(most_[k]) - 1);
      bit[k] = top_[k];
    }
    uint32_t key = 0;
    for (const int axis : axes_) key = key << 1 | uint32_t(at[axis] >> bit[axis]-- & 1);
    return key;
  }

 private:
  V3f least_;
  float cells_[3], most_[3];
  int axes_[key_bits], top_[3];
};

}  // namespace

float largest_scale(const float m[3][4]) {
  float most = 0;
  for (int j = 0; j < 3; ++j) most = std::max(most, length(V3f(m[0][j], m[1][j], m[2][j])));
  return most;
}

void PlacementSet::add(const float rows[3][4]) {
  if (size_ % width == 0) blocks_.push_back({});
  set_rows(size_++, rows);
}

void PlacementSet::set_rows(uint32_t i, const float rows[3][4]) {
  Block& block = blocks_[i / width];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) block.m[r][c][i % width] = rows[r][c];
}

void PlacementSet::rows(uint32_t i, float out[3][4]) const {
  const Block& block = blocks_[i / width];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out[r][c] = block.m[r][c][i % width];
}

V3f PlacementSet::origin(uint32_t i) const {
  const auto& m = blocks_[i / width].m;
  return {m[0][3][i % width], m[1][3][i % width], m[2][3][i % width]};
}

uint32_t PlacementSet::arrange() {
  Box3f box;
  for (uint32_t i = 0; i < size_; ++i) box.extendBy(origin(i));
  if (size_ < 2) return 0;
  const Curve curve(box);
  std::vector<uint64_t> keys(size_);  // and whose they are
  parallel_ranges(size_, 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) keys[i] = uint64_t(curve.key(origin(uint32_t(i)))) << 32 | i;
  });
  std::sort(keys.begin(), keys.end());
  // In place, cycle by cycle: `from` is where that which belongs at i lies.
  const auto from = [&keys](uint32_t i) -> uint32_t { return uint32_t(keys[i]); };
  constexpr uint64_t done = 0xffffffff;
  for (uint32_t first = 0; first < size_; ++first) {
    if (from(first) == done) continue;
    float held[3][4], moved[3][4];
    rows(first, held);
    uint32_t to = first;
    for (uint32_t next = from(to); next != first; next = from(to)) {
      rows(next, moved);
      set_rows(to, moved);
      keys[to] |= done;
      to = next;
    }
    set_rows(to, held);
    keys[to] |= done;
  }
  return leave_out_repeated(keys);
}

// Equal maps have equal keys. Those that are kept of a run of equal keys are found by what they hash to, so a million
// maps in one place take no longer than elsewhere.
uint32_t PlacementSet::leave_out_repeated(const std::vector<uint64_t>& keys) {
  uint32_t kept = 0;
  std::unordered_multimap<uint64_t, uint32_t> of_run;
  const auto key = [&keys](uint32_t i) { return keys[i] >> 32; };
  for (uint32_t i = 0; i < size_; ++i) {
    const bool begins = i == 0 || key(i) != key(i - 1), ends = i + 1 == size_ || key(i) != key(i + 1);
    if (begins && !of_run.empty()) of_run.clear();
    float m[3][4];
    rows(i, m);
    if (!begins || !ends) {
      const uint64_t hashed = hash_bytes({reinterpret_cast<const char*>(m), sizeof m}, 0);
      const auto [like, end] = of_run.equal_range(hashed);
      if (std::any_of(like, end, [&](const auto& other) {
            float its[3][4];
            rows(other.second, its);
            return std::memcmp(m, its, sizeof m) == 0;
          }))
        continue;
      of_run.emplace(hashed, kept);
    }
    if (kept != i) set_rows(kept, m);
    ++kept;
  }
  const uint32_t repeated = size_ - kept;
  const float nothing[3][4] = {};
  blocks_.resize((kept + width - 1) / width);
  for (size_ = kept; size_ % width != 0; ++size_) set_rows(size_, nothing);
  size_ = kept;
  return repeated;
}

Box3f PlacementSet::bounds(uint32_t block, const Box3f& object) const {
  Box3f out;
  if (object.isEmpty()) return out;
  const V3f middle = object.center(), half = (object.max - object.min) * 0.5f;
  const auto& m = blocks_[block].m;
  for (uint32_t k = 0; k < lanes(block); ++k) {
    V3f centre, reach;
    for (int r = 0; r < 3; ++r) {
      const float x = m[r][0][k] * middle.x, y = m[r][1][k] * middle.y, z = m[r][2][k] * middle.z, t = m[r][3][k];
      centre[r] = x + y + z + t;
      reach[r] = std::abs(m[r][0][k]) * half.x + std::abs(m[r][1][k]) * half.y + std::abs(m[r][2][k]) * half.z;
      reach[r] += rounding * (reach[r] + std::abs(x) + std::abs(y) + std::abs(z) + std::abs(t));
    }
    out.extendBy(centre - reach);
    out.extendBy(centre + reach);
  }
  return out;
}

}  // namespace dapple::trace
