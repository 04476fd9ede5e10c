// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/component_shape.h"

#include <Imath/ImathMatrixAlgo.h>

#include <algorithm>

namespace dapple::vegetation {

namespace {

using Imath::M33d;

// Calls body(a, b, c) with the corners of all triangles, quads as two.
template <class Body>
void for_each_triangle(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces,
                       const Body& body) {
  const size_t corners = size_t(mesh.corners);
  for (const uint32_t f : faces) {
    const uint32_t* index = &mesh.indices[f * corners];
    for (size_t i = 2; i < corners; ++i) body(V3d(P[index[0]]), V3d(P[index[i - 1]]), V3d(P[index[i]]));
  }
}

// Of fewer a line is enough.
constexpr size_t least_bent = 6;
// A parabola is taken where it leaves at most so much of the width about the line. The outline of a straight leaf may
// be bent as well, but it leaves more.
constexpr double straightened = 0.5;

// Of a triangle by its corners: exact for polynomials of degree 4 (Dunavant, "High degree efficient symmetrical
// Gaussian quadrature rules for the triangle", 1985).
struct Quadrature {
  double corner, others, weight;
};
constexpr Quadrature degree_4[] = {{0.108103018168070, 0.445948490915965, 0.223381589678011},
                                   {0.816847572980459, 0.091576213509771, 0.109951743655322}};

double triangle_area(const V3d& a, const V3d& b, const V3d& c) {
  return 0.5 * (b - a).cross(c - a).length();
}

// Calls body(point, weight), weights adding up to the area.
template <class Body>
void for_each_sample(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces,
                     const Body& body) {
  for_each_triangle(mesh, P, faces, [&](const V3d& a, const V3d& b, const V3d& c) {
    const double area = triangle_area(a, b, c);
    const V3d sum = a + b + c;
    for (const Quadrature& q : degree_4)
      for (const V3d& p : {a, b, c}) body(sum * q.others + p * (q.corner - q.others), q.weight * area);
  });
}

void add_square(M33d* m, const V3d& v, double weight) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) (*m)[i][j] += weight * v[i] * v[j];
}

}  // namespace

ComponentShape::ComponentShape(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces) {
  measure_area(mesh, P, faces);
  if (area_ > 0) fit_parabola(mesh, P, faces);
}

void ComponentShape::measure_area(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces) {
  const V3d near(P[mesh.indices[size_t(faces[0]) * size_t(mesh.corners)]]);
  V3d first(0, 0, 0);
  for_each_triangle(mesh, P, faces, [&](const V3d& a, const V3d& b, const V3d& c) {
    const double area = triangle_area(a, b, c);
    area_ += area;
    first += ((a - near) + (b - near) + (c - near)) * (area / 3);
    for (const V3d& p : {a, b, c}) bounds_.extendBy(V3f(p));
  });
  centre_ = near;
  if (!(area_ > 0)) return;
  centre_ += first / area_;
  // Of a triangle the mean of x x^T is (a a^T + b b^T + c c^T + 9 g g^T) / 12, g its centroid.
  M33d moments(0.0);
  for_each_triangle(mesh, P, faces, [&](V3d a, V3d b, V3d c) {
    const double area = triangle_area(a, b, c);
    a -= centre_, b -= centre_, c -= centre_;
    for (const V3d& p : {a, b, c}) add_square(&moments, p, area / 12), radius_ = std::max(radius_, p.length2());
    add_square(&moments, (a + b + c) / 3.0, area * 9 / 12);
    volume_ += a.dot(b.cross(c)) / 6;
  });
  radius_ = std::sqrt(radius_);
  volume_ = std::abs(volume_);
  second_moment_ = (moments[0][0] + moments[1][1] + moments[2][2]) / area_;
  covariance_ = moments * (1 / area_);
  V3d values;
  M33d vectors;
  moments = moments * (1 / std::max(area_ * second_moment_, 1e-300));
  Imath::jacobiEigenSolver(moments, values, vectors);
  const int longest = values.x >= values.y && values.x >= values.z ? 0 : values.y >= values.z ? 1 : 2;
  axis_ = V3d(vectors[0][longest], vectors[1][longest], vectors[2][longest]);
}

// Least squares over the area of a polynomial of second degree in t.
void ComponentShape::fit_parabola(const geom::Mesh& mesh, const std::vector<V3f>& P, std::span<const uint32_t> faces) {
  double low = 0, high = 0;
  for_each_triangle(mesh, P, faces, [&](const V3d& a, const V3d& b, const V3d& c) {
    for (const V3d& p : {a, b, c}) {
      const double t = (p - centre_).dot(axis_);
      low = std::min(low, t), high = std::max(high, t);
    }
  });
  length_ = high - low;
  width_ = width_about(mesh, P, faces);
  if (faces.size() < least_bent) return;

  const double unit = std::sqrt(second_moment_);
  double s[5] = {};
  V3d r[3] = {V3d(0, 0, 0), V3d(0, 0, 0), V3d(0, 0, 0)};
  for_each_sample(mesh, P, faces, [&](const V3d& p, double weight) {
    const V3d v = p - centre_;
    const double along = v.dot(axis_), t = along / unit;
    const V3d across = v - axis_ * along;
    double power = weight;
    for (int k = 0; k < 5; ++k, power *= t) {
      s[k] += power;
      if (k < 3) r[k] += across * power;
    }
  });
  const M33d m(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
  if (!(m.determinant() > 1e-9 * s[0] * s[2] * s[4])) return;
  const M33d inverse = m.inverse();
  const auto solved = [&](int row) { return r[0] * inverse[row][0] + r[1] * inverse[row][1] + r[2] * inverse[row][2]; };
  offset_ = solved(0), slope_ = solved(1) / unit, bend_ = solved(2) / (unit * unit);
  const double width = width_about(mesh, P, faces);
  if (width <= straightened * width_)
    width_ = width;
  else
    offset_ = slope_ = bend_ = V3d(0, 0, 0);
}

double ComponentShape::width_about(const geom::Mesh& mesh, const std::vector<V3f>& P,
                                   std::span<const uint32_t> faces) const {
  M33d squares(0.0);
  for_each_sample(mesh, P, faces, [&](const V3d& p, double weight) {
    const V3d v = p - centre_;
    const double t = v.dot(axis_);
    add_square(&squares, v - axis_ * t - offset_ - slope_ * t - bend_ * (t * t), weight);
  });
  V3d values;
  M33d vectors;
  const double trace = squares[0][0] + squares[1][1] + squares[2][2];
  if (!(trace > 0)) return 0;
  squares = squares * (1 / trace);
  Imath::jacobiEigenSolver(squares, values, vectors);
  return std::sqrt(12 * trace * std::max({values.x, values.y, values.z}) / area_);
}

V3d ComponentShape::widened(const V3f& p, double k) const {
  const double t = (V3d(p) - centre_).dot(axis_);
  const V3d on = centre_ + axis_ * t + offset_ + slope_ * t + bend_ * (t * t);
  return on + (V3d(p) - on) * k;
}

// The map's derivative is k I + (1 - k) c' axis^T, c' that of the parabola, whose part along the axis is 1; normals go
// by the transposed inverse (Sherman and Morrison).
V3f ComponentShape::widened_normal(const V3f& p, const V3f& n, double k) const {
  const double t = (V3d(p) - centre_).dot(axis_);
  const V3d tangent = axis_ + slope_ + bend_ * (2 * t);
  const V3d w = V3d(n) - axis_ * ((1 - k) * tangent.dot(V3d(n)));
  const double l = w.length();
  return l > 0 ? V3f(w / l) : n;
}

}  // namespace dapple::vegetation
