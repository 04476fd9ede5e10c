// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "dapple/media/uneven_medium.h"

namespace dapple::shafts {

/// How deep in an uneven medium a place lies from a light: optical depths at the nodes of a lattice over the medium's
/// bounds, trilinear between them (as deep shadow maps, Lokovic and Veach 2000, know the medium's own shadow; what
/// surfaces shade, ScanPlanes know). For parallel light the lattice stands in its direction, so one march down each row
/// of nodes fills all; of a lamp nodes keep the mean extinction on the way from it, which is smooth beside it, and
/// each is a march. Of a sun's disc: that of its centre.
///
/// Depths are those of the medium averaged over a cell: details of its density smaller than that throw no shadows.
class LightDepths {
 public:
  struct Settings {
    bool is_lamp = false;
    V3f light{0, 0, 1};                    ///< unit, towards parallel light; the place of a lamp
    int nodes = 0;                         ///< along the longest side; 0: parallel_nodes, lamp_nodes
    size_t max_bytes = size_t(256) << 20;  ///< the lattice is coarser where this is not enough
    uint64_t seed = 0;
  };
  static constexpr int parallel_nodes = 128, lamp_nodes = 64;

  /// The medium is read here alone.
  LightDepths(const media::UnevenMedium& medium, const Settings& settings);

  /// Optical depth from the light to a place of the medium.
  RGB at(const V3f& P) const;
  size_t bytes() const { return values_.size() * sizeof(float); }

 private:
  void place(const Box3f& bounds);
  void fill_parallel(const media::UnevenMedium& medium);
  void fill_lamp(const media::UnevenMedium& medium);
  void add(const media::MediumPoint& p, float length, float* sum) const;
  size_t node(int x, int y, int z) const { return ((size_t(z) * ny_ + size_t(y)) * nx_ + size_t(x)) * channels_; }
  V3f place_of(float x, float y, float z) const {
    return frame_.s * (low_.x + step_.x * x) + frame_.t * (low_.y + step_.y * y) + frame_.n * (low_.z + step_.z * z);
  }

  Settings settings_;
  Frame frame_{V3f(0, 0, 1)};
  V3f low_{0, 0, 0}, step_{1, 1, 1}, per_step_{1, 1, 1};  // in the frame, from the world's origin
  size_t nx_ = 2, ny_ = 2, nz_ = 2, channels_ = 1;
  RGB color_{1};  // of one channel: what all three are of it
  Box3f bounds_;
  std::vector<float> values_;
};

}  // namespace dapple::shafts
