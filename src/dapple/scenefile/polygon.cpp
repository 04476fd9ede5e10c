// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/polygon.h"

#include <cmath>

namespace dapple::scenefile {

namespace {

constexpr size_t always_clipped = 32;  // corners; cheap enough for any number of polygons

struct Point {
  double x, y;
};

// Twice the signed area of a triangle.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// The polygon seen along its normal, counter-clockwise.
std::vector<Point> flatten(std::span<const int32_t> corners, std::span<const V3f> P) {
  V3d n(0, 0, 0);
  for (size_t i = 0; i < corners.size(); ++i) {
    const V3d a(P[size_t(corners[i])]), b(P[size_t(corners[(i + 1) % corners.size()])]);
    n.x += (a.y - b.y) * (a.z + b.z);
    n.y += (a.z - b.z) * (a.x + b.x);
    n.z += (a.x - b.x) * (a.y + b.y);
  }
  int axis = 2;
  for (int k = 0; k < 3; ++k)
    if (std::abs(n[k]) > std::abs(n[axis])) axis = k;
  const int u = n[axis] < 0 ? (axis + 2) % 3 : (axis + 1) % 3;
  const int v = n[axis] < 0 ? (axis + 1) % 3 : (axis + 2) % 3;
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const int32_t c : corners) points.push_back({P[size_t(c)][u], P[size_t(c)][v]});
  return points;
}

bool is_convex(const std::vector<Point>& p) {
  const size_t n = p.size();
  for (size_t i = 0; i < n; ++i)
    if (turn(p[i], p[(i + 1) % n], p[(i + 2) % n]) < 0) return false;
  return true;
}

// Ear clipping on a linked list of the corners left (Meisters 1975). Clipping an ear can change only whether its
// neighbours are ears.
class EarClipper {
 public:
  explicit EarClipper(std::vector<Point> points) : points_(std::move(points)), links_(points_.size()) {
    const size_t n = points_.size();
    for (size_t i = 0; i < n; ++i) links_[i] = {(i + n - 1) % n, (i + 1) % n, false};
    for (size_t i = 0; i < n; ++i) links_[i].ear = is_ear(i);
  }

  template <class Emit>
  void clip(Emit emit) {
    size_t at = 0;
    for (size_t left = points_.size(); left > 3; --left) {
      at = find_ear(at, left);
      const auto [before, after, ear] = links_[at];
      emit(before, at, after);
      links_[before].next = after;
      links_[after].previous = before;
      links_[before].ear = is_ear(before);
      links_[after].ear = is_ear(after);
      at = after;
    }
    emit(links_[at].previous, at, links_[at].next);
  }

 private:
  struct Link {
    size_t previous, next;
    bool ear;
  };

  // A polygon that crosses itself may have no ear; then any corner must do.
  size_t find_ear(size_t from, size_t left) const {
    size_t i = from;
    for (size_t k = 0; k < left; ++k, i = links_[i].next)
      if (links_[i].ear) return i;
    return from;
  }

  bool is_reflex(size_t i) const { return turn(points_[links_[i].previous], points_[i], points_[links_[i].next]) < 0; }

  bool is_ear(size_t i) const {
    const Point &a = points_[links_[i].previous], &b = points_[i], &c = points_[links_[i].next];
    if (turn(a, b, c) <= 0) return false;
    for (size_t k = links_[links_[i].next].next; k != links_[i].previous; k = links_[k].next) {
      const Point& p = points_[k];
      const bool inside = turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
      const auto same = [&p](const Point& q) { return p.x == q.x && p.y == q.y; };
      if (inside && is_reflex(k) && !same(a) && !same(b) && !same(c)) return false;
    }
    return true;
  }

  std::vector<Point> points_;
  std::vector<Link> links_;
};

}  // namespace

void Triangulator::add(std::span<const int32_t> corners, std::span<const V3f> P, std::vector<int32_t>* triangles) {
  const auto emit = [&](size_t a, size_t b, size_t c) {
    triangles->insert(triangles->end(), {corners[a], corners[b], corners[c]});
  };
  const size_t n = corners.size(), pairs = n <= always_clipped ? 0 : n < (size_t(1) << 20) ? n * n : SIZE_MAX;
  if (pairs <= corner_pairs_left_) {
    std::vector<Point> points = flatten(corners, P);
    if (!is_convex(points)) {
      corner_pairs_left_ -= pairs;
      return EarClipper(std::move(points)).clip(emit);
    }
  }
  for (size_t i = 2; i < n; ++i) emit(0, i - 1, i);
}

}  // namespace dapple::scenefile
