// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::forest {

/// Area of surfaces within a plot, by height, inclination of the normal and kind: the leaf statistics U of illumination
/// under trees, section 5.2, from actual polygons. Polygons are cut exactly at the plot's borders and at the slabs'
/// edges.
class LeafSurvey {
 public:
  struct Frame {
    Box2f plot;  ///< x and y, m; what is beyond does not count
    std::vector<double>
        edges_m;  ///< of the slabs, ascending, 2 or more; what is below or above counts in the last slab on that side
    int inclinations = 18;  ///< equal bins of the angle between normal and vertical, from 0 to 90 degrees
    int kinds = 1;
  };

  /// std::invalid_argument for fewer than one slab, inclination or kind, and for edges that do not ascend.
  explicit LeafSurvey(Frame frame);

  /// A flat convex polygon, m. `share`: of its area that counts.
  void add_polygon(int kind, std::span<const V3d> corners, double share);
  /// Exact where it lies within the plot, as a polygon of 256 corners where it crosses the border.
  void add_disk(int kind, const V3d& centre, double radius, const V3d& unit_normal, double share);
  void add(const LeafSurvey& other);

  const Frame& frame() const { return frame_; }
  int slabs() const { return int(frame_.edges_m.size()) - 1; }
  double area(int slab, int inclination, int kind) const { return area_[index(slab, inclination, kind)]; }  ///< m^2
  double area(int slab, int kind) const;
  double area(int kind) const;
  double plot_area() const;

 private:
  size_t index(int slab, int inclination, int kind) const {
    return (size_t(kind) * size_t(slabs()) + size_t(slab)) * size_t(frame_.inclinations) + size_t(inclination);
  }
  int inclination_of(const V3d& normal) const;
  bool add_whole(int kind, std::span<const V3d> corners, double share, double low, double high);

  Frame frame_;
  std::vector<double> squared_cosines_;  // of the bins' inner edges
  std::vector<double> area_;
};

}  // namespace dapple::forest
