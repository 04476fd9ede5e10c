// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::path {

/// What a path found at the first leaf that it met after a diffuse scattering.
struct LeafNote {
  uint32_t geometry = trace::no_id;
  V3f P, n;           ///< n: unit, on the side on which the path came
  RGB front, behind;  ///< what irradiance on that side, and on the other, brings to the path
  RGB scattered;      ///< what the path brought of light that came to the leaf from other surfaces, or from media
};

/// Notes of paths that are traced before rendering, of a block at a time.
class LeafNotes {
 public:
  /// `is_leaf`: by geometry; it must outlive this.
  explicit LeafNotes(const std::vector<uint8_t>& is_leaf) : is_leaf_(is_leaf) {}

  void start(int paths) {
    path_count_ = paths;
    std::fill_n(state_, paths, State::before);
  }
  bool wants(int p, uint32_t geometry) const { return state_[p] == State::before && is_leaf_[geometry] != 0; }
  void note(int p, const LeafNote& note) {
    state_[p] = State::at_leaf;
    number_[p] = uint32_t(notes.size());
    notes.push_back(note);
  }
  /// The path, which has brought `so_far`, meets the next surface, or is scattered in a medium.
  void arrive(int p, const RGB& so_far) {
    if (state_[p] != State::at_leaf) return;
    state_[p] = State::beyond;
    before_[p] = so_far;
  }
  /// The paths have brought L, and what they bring from now on has nothing to do with the leaves noted.
  void close(const RGB* L) {
    for (int p = 0; p < path_count_; ++p) {
      if (state_[p] == State::before) continue;
      LeafNote& n = notes[number_[p]];
      if (state_[p] == State::beyond) n.scattered = L[p] - before_[p];
      if (!is_kept(L[p])) n.front = n.behind = n.scattered = RGB();
      state_[p] = State::before;
    }
  }
  /// The same at their end.
  void finish(const RGB* L) {
    close(L);
    for (int p = 0; p < path_count_; ++p)
      if (is_kept(L[p])) light += double(L[p].luminance());
  }

  std::vector<LeafNote> notes;
  double light = 0;  ///< luminance of all paths, added up

 private:
  enum class State : uint8_t { before, at_leaf, beyond };

  /// By scene::Film.
  static bool is_kept(const RGB& L) { return L.is_finite() && std::min({L.r, L.g, L.b}) >= 0; }

  const std::vector<uint8_t>& is_leaf_;
  int path_count_ = 0;
  State state_[trace::RayBatch::capacity] = {};
  uint32_t number_[trace::RayBatch::capacity] = {};
  RGB before_[trace::RayBatch::capacity];
};

}  // namespace dapple::path
