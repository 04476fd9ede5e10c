// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Imath/ImathMatrix.h>

#include <span>

#include "dapple/geom/mesh.h"

namespace dapple::vegetation {

/// What a component of a mesh (a leaf, a needle, a twig) measures: moments of its area, and the line, or where it is
/// bent by more than its width the parabola, along which it is long. Lengths in units of the mesh.
class ComponentShape {
 public:
  /// `P` are the mesh's positions at shutter open or close.
  ComponentShape(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces);

  double area() const { return area_; }
  const V3d& centre() const { return centre_; }
  /// Of the least ball about its centre.
  double radius() const { return radius_; }
  /// Between its ends along the axis of largest moment.
  double length() const { return length_; }
  /// Width of the strip whose area spreads as far from its middle line as the component's from that line or parabola,
  /// in the direction across it in which it spreads most; of a tube 1.2 of its diameter.
  double width() const { return width_; }
  /// Of the cone from its centre over it: of a closed surface, what it encloses.
  double volume() const { return volume_; }
  const Box3f& bounds() const { return bounds_; }
  /// Mean of x x^T over the area, x from the centre.
  const Imath::M33d& covariance() const { return covariance_; }

  /// A point after scaling all by k about the centre.
  V3d scaled(const V3f& p, double k) const { return centre_ + (V3d(p) - centre_) * k; }
  /// A point after scaling across the line or parabola, by k.
  V3d widened(const V3f& p, double k) const;
  /// A normal at p after that, of unit length.
  V3f widened_normal(const V3f& p, const V3f& n, double k) const;

 private:
  void measure_area(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces);
  void fit_parabola(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces);
  double width_about(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces) const;

  double area_ = 0, second_moment_ = 0, radius_ = 0, length_ = 0, width_ = 0, volume_ = 0;
  Imath::M33d covariance_;
  V3d centre_{0, 0, 0}, axis_{1, 0, 0};
  V3d offset_{0, 0, 0}, slope_{0, 0, 0},
      bend_{0, 0, 0};  ///< the parabola less t axis, at t along the axis: a polynomial; 0: the line
  Box3f bounds_;
};

}  // namespace dapple::vegetation
