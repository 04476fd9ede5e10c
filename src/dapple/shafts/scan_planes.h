// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/shafts/plane_fan.h"

namespace dapple::shafts {

/// Where the rays of light of a block enter the medium, at its begin and end.
struct EntryLine {
  float begin = 0, end = 0;
};

/// Scan planes through an eye and a light (Max 1986, "Atmospheric illumination and shadows"), as arrays.
///
/// A half-plane ends in the axis from the eye to the light. Rays of light lie in it side by side, numbered by a
/// coordinate u > 0 that grows along each ray from the eye:
///   parallel light: u is the distance p from the axis, m; the height of a point is q, m along the axis from the eye;
///   a lamp: u is the angle psi at it, from the eye's direction, below pi; the height is -r, the distance from it.
/// A point is lit where its height is at or above that of the first thing that stands in the way of its ray of light,
/// for shadow begins there and does not end: one number a ray. (The same as Max's shadow edges, which do not cross, as
/// the masks of Baran et al. 2010 and the height fields of Chen et al. 2011.)
///
/// Rays come in bins, u_j = c (e^(j g) - 1), narrow near the eye. 16 make a block, whose least and largest heights of
/// blockers tell whether it is lit or dark as a whole. Filled plane by plane from any threads; then immutable.
class ScanPlanes {
 public:
  static constexpr int block = 16;

  struct Settings {
    V3f eye{0, 0, 0};
    V3f axis{0, 0, 1};      ///< unit, from the eye to the light; of parallel rays beside a lamp, along them
    float lamp = infinity;  ///< distance of a lamp; infinite for parallel light
    /// Unit, of all view rays, which are parallel: orthographic; 0: they come from the eye. Beside a lamp the eye is a
    /// place before it.
    V3f view{0, 0, 0};
    PlaneFan fan;           ///< around Frame(axis); of parallel rays under parallel light along side(), m
    int bins = 1024;        ///< made a multiple of `block`
    float nearest = 0.01f;  ///< c: bins are even below this u
    float farthest = 1;     ///< u of the last bin's end, which of a lamp is pi; beyond, nothing stands in the way
    bool open = true;       ///< of parallel light: the medium goes on beyond the last bin
    bool bounded = false;   ///< rays of light enter the medium somewhere: entry() is kept
    bool tinted = false;    ///< they differ in colour or strength: tint() is kept
    float entry_error = 0;  ///< by which a line along a block may miss entry()
  };
  explicit ScanPlanes(const Settings& settings);

  const Settings& settings() const { return settings_; }
  const Frame& frame() const { return frame_; }
  bool is_orthographic() const { return settings_.view != V3f(0, 0, 0); }
  /// Planes side by side, not around an axis.
  bool is_sheaf() const { return is_orthographic() && !is_lamp(); }
  bool is_lamp() const { return settings_.lamp < infinity; }
  int planes() const { return settings_.fan.planes; }
  int bins() const { return settings_.bins; }
  int blocks() const { return settings_.bins / block; }
  size_t bytes() const;
  static size_t bytes_of(const Settings& settings);

  /// Begin of bin j; end of the last for j = bins().
  float edge(int j) const { return edges_[size_t(j)]; }
  const float* edges() const { return edges_.data(); }
  /// Of lamps: sine and cosine of edge and middle of each bin; those of middle j at bins() + 1 + j.
  const float* sines() const { return sines_.data(); }
  const float* cosines() const { return cosines_.data(); }
  /// Edges of blocks, and of lamps their sines and cosines; the last repeated, `block` times.
  const float* block_edges() const { return block_edges_.data(); }
  const float* block_sines() const { return block_sines_.data(); }
  const float* block_cosines() const { return block_cosines_.data(); }
  /// The bin of u, within one.
  int bin_of(float u) const;
  /// Unit vector across the axis, in plane k.
  V3f across(int plane) const;
  /// Of a sheaf: unit, across all planes.
  V3f side() const { return side_; }
  /// Where a ray of light passes: the point of height 0 of parallel light; the direction in which a lamp sends it.
  V3f foot(int plane, float u) const {
    const float off = is_sheaf() ? settings_.fan.first + float(plane) * settings_.fan.step : 0;
    return settings_.eye + side_ * off + across(plane) * u;
  }
  V3f lamp_direction(int plane, float u) const { return frame_.n * -std::cos(u) + across(plane) * std::sin(u); }

  // Writing, a plane at a time, by one thread.
  float* blocked(int plane) { return blocked_.data() + row(plane); }  ///< heights: -infinity, nothing; infinity, dark
  float* entry(int plane) { return bounded() ? entry_.data() + row(plane) : nullptr; }  ///< infinity: no light enters
  RGB* tint(int plane) { return tinted() ? tint_.data() + row(plane) : nullptr; }
  /// After these are written.
  void close(int plane);

  // Reading.
  bool bounded() const { return settings_.bounded; }
  bool tinted() const { return settings_.tinted; }
  const float* blocked(int plane) const { return blocked_.data() + row(plane); }
  /// Where light enters the medium: what AirLight subtracts of the column to the light; infinite where it does not.
  const float* entry(int plane) const { return bounded() ? entry_.data() + row(plane) : nullptr; }
  const RGB* tint(int plane) const { return tinted() ? tint_.data() + row(plane) : nullptr; }
  const float* least(int plane) const { return least_.data() + size_t(plane) * size_t(blocks()); }
  const float* most(int plane) const { return most_.data() + size_t(plane) * size_t(blocks()); }
  /// Of each block: its rays of light have the same tint.
  static constexpr uint8_t even_tint = 1;
  /// They set out in the medium.
  static constexpr uint8_t no_entry = 2;
  /// entry_line() stands for entry().
  static constexpr uint8_t even_entry = 4;
  const uint8_t* marks(int plane) const { return marks_.data() + size_t(plane) * size_t(blocks()); }
  const EntryLine* entry_line(int plane) const {
    return bounded() ? lines_.data() + size_t(plane) * size_t(blocks()) : nullptr;
  }

  /// The plane for a ray along d: that before or after it, by xi in [0, 1), so that the mean is linear between planes.
  /// Of a sheaf: for a ray whose origin is so far from the eye.
  int plane_of(const V3f& d, float xi) const;
  int plane_beside(const V3f& off, float xi) const;

 private:
  uint8_t mark(int plane, int block_number, EntryLine* line) const;
  size_t row(int plane) const { return size_t(plane) * size_t(bins()); }

  Settings settings_;
  Frame frame_;
  V3f side_{0, 0, 0}, ahead_{0, 0, 0};  // of parallel view rays: across all planes; in them, across the axis
  float growth_ = 1;
  std::vector<float> edges_, sines_, cosines_, block_edges_, block_sines_, block_cosines_, blocked_, entry_, least_,
      most_;
  std::vector<uint8_t> marks_;
  std::vector<EntryLine> lines_;
  std::vector<RGB> tint_;
};

}  // namespace dapple::shafts
