// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/leaf_survey.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace dapple::forest {

namespace {

constexpr int disk_corners = 256;

/// A polygon that is cut again and again.
struct Polygon {
  std::vector<V3d> corners, scratch;

  /// Keeps what lies where side * (p[axis] - at) <= 0 (Sutherland and Hodgman 1974).
  void cut(int axis, double at, double side) {
    scratch.clear();
    const size_t n = corners.size();
    for (size_t i = 0; i < n; ++i) {
      const V3d &a = corners[i], &b = corners[(i + 1) % n];
      const double da = side * (a[axis] - at), db = side * (b[axis] - at);
      if (da <= 0) scratch.push_back(a);
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) scratch.push_back(a + (b - a) * (da / (da - db)));
    }
    corners.swap(scratch);
  }
};

V3d vector_area(std::span<const V3d> p) {
  V3d sum(0, 0, 0);
  for (size_t i = 2; i < p.size(); ++i) sum += (p[i - 1] - p[0]).cross(p[i] - p[0]);
  return sum * 0.5;
}

/// Area of a unit disk on the side of a line at signed distance x from its centre.
double disk_segment(double x) {
  if (x <= -1) return 0;
  if (x >= 1) return std::numbers::pi;
  return std::numbers::pi / 2 + std::asin(x) + x * std::sqrt(1 - x * x);
}

}  // namespace

LeafSurvey::LeafSurvey(Frame frame) : frame_(std::move(frame)) {
  if (frame_.edges_m.size() < 2 || frame_.inclinations < 1 || frame_.kinds < 1)
    throw std::invalid_argument("a survey needs a slab, an inclination and a kind");
  if (std::adjacent_find(frame_.edges_m.begin(), frame_.edges_m.end(), std::greater_equal<>()) != frame_.edges_m.end())
    throw std::invalid_argument("the slabs' edges do not ascend");
  for (int i = 1; i < frame_.inclinations; ++i) {
    const double cosine = std::cos(std::numbers::pi / 2 * i / frame_.inclinations);
    squared_cosines_.push_back(cosine * cosine);
  }
  area_.assign(size_t(slabs()) * size_t(frame_.inclinations) * size_t(frame_.kinds), 0);
}

int LeafSurvey::inclination_of(const V3d& n) const {
  const double z2 = n.z * n.z, length2 = n.length2();
  int i = 0;
  while (i + 1 < frame_.inclinations && z2 <= squared_cosines_[size_t(i)] * length2) ++i;
  return i;
}

// Most leaves lie within one slab: true if this one does.
bool LeafSurvey::add_whole(int kind, std::span<const V3d> corners, double share, double low, double high) {
  const auto& edges = frame_.edges_m;
  const int above = int(std::upper_bound(edges.begin(), edges.end(), low) - edges.begin()),
            s = std::clamp(above - 1, 0, slabs() - 1);
  if (s < slabs() - 1 && high >= edges[size_t(s) + 1]) return false;
  const V3d normal = vector_area(corners);
  const double size = normal.length();
  if (size > 0) area_[index(s, inclination_of(normal), kind)] += share * size;
  return true;
}

void LeafSurvey::add_polygon(int kind, std::span<const V3d> corners, double share) {
  const Box2f& plot = frame_.plot;
  V3d least = corners[0], most = least;
  for (const V3d& p : corners)
    for (int k = 0; k < 3; ++k) least[k] = std::min(least[k], p[k]), most[k] = std::max(most[k], p[k]);
  bool whole = true;
  for (int k = 0; k < 2; ++k) {
    if (most[k] < plot.min[k] || least[k] > plot.max[k]) return;
    whole = whole && least[k] >= plot.min[k] && most[k] <= plot.max[k];
  }
  if (whole && add_whole(kind, corners, share, least.z, most.z)) return;
  static thread_local Polygon inside, piece;
  inside.corners.assign(corners.begin(), corners.end());
  for (int k = 0; k < 2; ++k) {
    inside.cut(k, plot.min[k], -1);
    inside.cut(k, plot.max[k], 1);
  }
  if (inside.corners.size() < 3) return;
  const V3d normal = vector_area(corners);
  const double size = normal.length();
  if (!(size > 0)) return;
  const int inclination = inclination_of(normal);
  double low = inside.corners[0].z, high = low;
  for (const V3d& p : inside.corners) low = std::min(low, p.z), high = std::max(high, p.z);
  const auto& edges = frame_.edges_m;
  const int last = slabs() - 1;
  for (int s = 0; s <= last; ++s) {
    // A level polygon in the plane of an edge belongs to the slab above it.
    const bool beneath = s > 0 && (high < edges[size_t(s)] || (high == edges[size_t(s)] && low < high));
    if (beneath || (s < last && low >= edges[size_t(s) + 1])) continue;
    piece.corners = inside.corners;
    if (s > 0 && low < edges[size_t(s)]) piece.cut(2, edges[size_t(s)], -1);
    if (s < last && high > edges[size_t(s) + 1]) piece.cut(2, edges[size_t(s) + 1], 1);
    if (piece.corners.size() >= 3) area_[index(s, inclination, kind)] += share * vector_area(piece.corners).length();
  }
}

void LeafSurvey::add_disk(int kind, const V3d& c, double radius, const V3d& n, double share) {
  const Box2f& plot = frame_.plot;
  bool whole = true;
  for (int k = 0; k < 2; ++k) {
    const double reach = radius * std::sqrt(std::max(0.0, 1 - n[k] * n[k]));
    if (c[k] + reach <= plot.min[k] || c[k] - reach >= plot.max[k]) return;
    whole = whole && c[k] - reach >= plot.min[k] && c[k] + reach <= plot.max[k];
  }
  const double slope = std::sqrt(std::max(0.0, 1 - n.z * n.z));
  if (!whole) {
    // Around the same area, so that a border through the middle of many disks costs nothing on average.
    const V3d a = slope > 1e-9 ? V3d(n.y, -n.x, 0) * (1 / slope) : V3d(1, 0, 0), b = n.cross(a);
    const double angle = 2 * std::numbers::pi / disk_corners, r = radius * std::sqrt(angle / std::sin(angle));
    V3d corners[disk_corners];
    for (int i = 0; i < disk_corners; ++i) corners[i] = c + (a * std::cos(angle * i) + b * std::sin(angle * i)) * r;
    return add_polygon(kind, corners, share);
  }
  const int inclination = inclination_of(n), last = slabs() - 1;
  const auto& edges = frame_.edges_m;
  const double reach = radius * slope;
  const auto below = [&](int edge) {  // fraction of the disk, as area of the unit disk
    if (edge <= 0) return 0.0;
    if (edge > last) return std::numbers::pi;
    const double dz = edges[size_t(edge)] - c.z;
    return reach > 0 ? disk_segment(dz / reach) : dz > 0 ? std::numbers::pi : 0.0;
  };
  const int first =
      std::clamp(int(std::upper_bound(edges.begin(), edges.end(), c.z - reach) - edges.begin()) - 1, 0, last);
  for (int s = first; s <= last && (s == first || edges[size_t(s)] < c.z + reach); ++s)
    area_[index(s, inclination, kind)] += share * radius * radius * (below(s + 1) - below(s));
}

void LeafSurvey::add(const LeafSurvey& other) {
  for (size_t i = 0; i < area_.size(); ++i) area_[i] += other.area_[i];
}

double LeafSurvey::area(int slab, int kind) const {
  double sum = 0;
  for (int i = 0; i < frame_.inclinations; ++i) sum += area(slab, i, kind);
  return sum;
}

double LeafSurvey::area(int kind) const {
  double sum = 0;
  for (int s = 0; s < slabs(); ++s) sum += area(s, kind);
  return sum;
}

double LeafSurvey::plot_area() const {
  return (double(frame_.plot.max.x) - frame_.plot.min.x) * (double(frame_.plot.max.y) - frame_.plot.min.y);
}

}  // namespace dapple::forest
