// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::integrate {

/// Some light, and the parts of it by groups of lights: as many as are kept, in most renders none.
struct LightParts {
  RGB sum;
  const RGB* parts = nullptr;
};

/// Scales parts so that they make up this sum, channel by channel. Where there is no light to share it among, it falls
/// to group 0.
void share_out(const RGB& sum, std::span<RGB> parts);

/// Radiance or irradiance at each element of a batch, and where groups of lights have images of their own, its parts by
/// group. All that is done to a sum is done to its parts, which add up to it but for rounding; the sums are the same,
/// bit for bit, with parts and without.
class LightSums {
 public:
  static constexpr int capacity = 4 * trace::RayBatch::capacity;

  explicit LightSums(int groups) : groups_(groups), parts_(size_t(groups) * capacity) {}

  int groups() const { return groups_; }
  const RGB& operator[](int i) const { return sums_[i]; }
  std::span<const RGB> parts(int i) const { return {parts_.data() + i * groups_, size_t(groups_)}; }
  LightParts at(int i) const { return {sums_[i], parts_.data() + i * groups_}; }

  void clear(int i) {
    sums_[i] = RGB();
    if (groups_ > 0) clear_parts(i, 1);
  }
  void clear_all(int count) {
    std::fill_n(sums_, count, RGB());
    if (groups_ > 0) clear_parts(0, count);
  }
  /// Light of one group.
  void add(int i, const RGB& light, int group) {
    sums_[i] += light;
    if (groups_ > 0) parts_[size_t(i * groups_ + group)] += light;
  }
  void add(int i, const LightParts& light) {
    sums_[i] += light.sum;
    if (groups_ > 0) add_parts(i, RGB(1), light.parts);
  }
  void add(int i, const RGB& weight, const LightParts& light) {
    sums_[i] += weight * light.sum;
    if (groups_ > 0) add_parts(i, weight, light.parts);
  }
  void scale(int i, const RGB& by) {
    sums_[i] *= by;
    if (groups_ > 0) scale_parts(i, by);
  }
  void set(int i, const LightParts& light) {
    clear(i);
    add(i, light);
  }
  /// Whose parts nobody asks for.
  void set_alone(int i, const RGB& sum) {
    clear(i);
    sums_[i] = sum;
  }
  /// linear(a, b): a function that is linear in both, of the elements i of these.
  template <class Linear>
  void set(int i, const LightSums& a, const LightSums& b, const Linear& linear) {
    sums_[i] = linear(a.sums_[i], b.sums_[i]);
    if (groups_ == 0) return;
    for (int j = i * groups_; j < (i + 1) * groups_; ++j)
      parts_[size_t(j)] = linear(a.parts_[size_t(j)], b.parts_[size_t(j)]);
  }
  /// What became of the sum by a function that need not be linear: its parts in proportion.
  void change(int i, const RGB& sum) {
    sums_[i] = sum;
    if (groups_ > 0) share_out(sum, {part(i), size_t(groups_)});
  }

 private:
  RGB* part(int i) { return parts_.data() + i * groups_; }
  void clear_parts(int i, int count);
  void add_parts(int i, const RGB& weight, const RGB* parts);
  void scale_parts(int i, const RGB& by);

  const int groups_;
  RGB sums_[capacity];
  std::vector<RGB> parts_;  // by element and group
};

}  // namespace dapple::integrate
