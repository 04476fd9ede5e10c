// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/lens_system.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dapple::scene {

namespace {

struct Path {
  V3d o, d;
};

constexpr double far_away = 1e12;

/// Moves p to the surface: true where it meets it within its width; *n is the normal against p's direction.
bool meet(const LensSystem::Surface& s, Path* p, V3d* n) {
  double t;
  if (s.radius == 0) {
    if (p->d.z == 0) return false;
    t = (s.z - p->o.z) / p->d.z;
  } else {
    const V3d middle(0, 0, s.z - s.radius);
    const V3d from = p->o - middle;
    const double b = dot(from, p->d), c = dot(from, from) - s.radius * s.radius, root = b * b - c;
    if (root < 0) return false;
    // Of the sphere's two places the one on the side of the vertex.
    const bool nearer = (p->d.z > 0) != (s.radius > 0);
    t = -b + (nearer ? -std::sqrt(root) : std::sqrt(root));
  }
  if (!(t >= -1e-9)) return false;
  p->o += p->d * t;
  if (p->o.x * p->o.x + p->o.y * p->o.y > s.half_width * s.half_width) return false;
  if (s.radius != 0) {
    *n = (p->o - V3d(0, 0, s.z - s.radius)) * (1 / s.radius);
    if (dot(*n, p->d) > 0) *n = -*n;
  }
  return true;
}

bool bend(Path* p, const V3d& n, double ratio) {  // ratio: index before over behind
  const double c = -dot(n, p->d), sin2 = ratio * ratio * std::max(0.0, 1 - c * c);
  if (sin2 >= 1) return false;
  const V3d d = p->d * ratio + n * (ratio * c - std::sqrt(1 - sin2));
  p->d = d * (1 / std::sqrt(dot(d, d)));
  return true;
}

V3d wide(const V3f& v) {
  return V3d(double(v.x), double(v.y), double(v.z));
}
V3f narrow(const V3d& v) {
  return V3f(float(v.x), float(v.y), float(v.z));
}

ApertureShape of_corners(std::vector<V2f> corners) {
  ApertureShape shape;
  shape.kind = ApertureShape::polygon;
  shape.corners = std::move(corners);
  return shape;
}

V2f on_circle(float degrees_from_top, float radius) {
  return V2f(std::sin(radians(degrees_from_top)) * radius, std::cos(radians(degrees_from_top)) * radius);
}

}  // namespace

ApertureShape ApertureShape::square() {
  return of_corners({{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}});
}

ApertureShape ApertureShape::pentagon() {
  std::vector<V2f> corners;
  for (int i = 0; i < 5; ++i) corners.push_back(on_circle(72.0f * float(i), 0.8f));
  return of_corners(std::move(corners));
}

ApertureShape ApertureShape::star() {
  std::vector<V2f> corners;
  const float inner = std::cos(radians(72)) / std::cos(radians(36));
  for (int i = 0; i < 10; ++i) corners.push_back(on_circle(36.0f * float(i), i % 2 ? inner : 1));
  return of_corners(std::move(corners));
}

float ApertureShape::passes(const V2f& at) const {
  switch (kind) {
    case round:
      return 1;
    case gaussian: {
      const float r2 = at.x * at.x + at.y * at.y;
      return std::max(0.0f, std::exp(-4 * r2) - std::exp(-4.0f));
    }
    case polygon: {
      bool inside = false;
      for (size_t i = 0, k = corners.size() - 1; i < corners.size(); k = i++) {
        const V2f &a = corners[i], &b = corners[k];
        if ((a.y > at.y) != (b.y > at.y) && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x) inside = !inside;
      }
      return inside ? 1.0f : 0.0f;
    }
    case picture: {
      const int x = std::clamp(int((at.x + 1) / 2 * float(resolution.x)), 0, resolution.x - 1),
                y = std::clamp(int((1 - at.y) / 2 * float(resolution.y)), 0, resolution.y - 1);
      return values[size_t(y) * size_t(resolution.x) + size_t(x)];
    }
  }
  return 1;
}

LensSystem::LensSystem(std::vector<Surface> surfaces, ApertureShape shape, double film_diagonal, double focus_distance)
    : surfaces_(std::move(surfaces)), shape_(std::move(shape)), film_diagonal_(film_diagonal) {
  if (std::none_of(surfaces_.begin(), surfaces_.end(), [](const Surface& s) { return s.radius != 0; }))
    throw std::invalid_argument("none of its surfaces bends light");
  focus(focus_distance);
  bound_pupils();
  find_exposure();
}

void LensSystem::place_surfaces(double film_to_rear) {
  surfaces_.back().thickness = film_to_rear;
  double z = 0;
  for (size_t i = surfaces_.size(); i-- > 0;) surfaces_[i].z = z += surfaces_[i].thickness;
}

bool LensSystem::to_scene(const V3f& o, const V3f& d, V3f* out_o, V3f* out_d, float* passes) const {
  Path p{wide(o), wide(d)};
  for (size_t i = surfaces_.size(); i-- > 0;) {
    const Surface& s = surfaces_[i];
    V3d n(0, 0, 0);
    if (!meet(s, &p, &n)) return false;
    if (s.radius == 0) {
      if (shape_.kind == ApertureShape::round) continue;
      const float share = shape_.passes(V2f(float(p.o.x / s.half_width), float(p.o.y / s.half_width)));
      if (share <= 0) return false;
      if (passes) *passes *= share;
      continue;
    }
    if (!bend(&p, n, s.index / (i > 0 ? surfaces_[i - 1].index : 1))) return false;
  }
  *out_o = narrow(p.o), *out_d = narrow(p.d);
  return true;
}

bool LensSystem::to_film(const V3f& o, const V3f& d, V3f* out_o, V3f* out_d) const {
  Path p{wide(o), wide(d)};
  for (size_t i = 0; i < surfaces_.size(); ++i) {
    const Surface& s = surfaces_[i];
    V3d n(0, 0, 0);
    if (!meet(s, &p, &n)) return false;
    if (s.radius == 0) {
      if (shape_.passes(V2f(float(p.o.x / s.half_width), float(p.o.y / s.half_width))) <= 0) return false;
      continue;
    }
    if (!bend(&p, n, (i > 0 ? surfaces_[i - 1].index : 1) / s.index)) return false;
  }
  *out_o = narrow(p.o), *out_d = narrow(p.d);
  return true;
}

// Gaussian optics of the whole: near the axis each surface changes the slope of a ray linearly. A ray is (height, slope
// times index) and runs from the scene to the film.
void LensSystem::focus(double distance) {
  double a = 1, b = 0, c = 0, d = 1, before = 1, length = 0;  // of (height, slope) from the first to the last vertex
  for (size_t i = 0; i < surfaces_.size(); ++i) {
    const Surface& s = surfaces_[i];
    if (s.radius != 0) {
      const double power = (s.index - before) / s.radius;
      c -= power * a, d -= power * b;
      before = s.index;
    }
    if (i + 1 == surfaces_.size()) break;
    a += s.thickness / before * c, b += s.thickness / before * d;
    length += s.thickness;
  }
  if (!(c < 0)) throw std::invalid_argument("it does not gather light: its focal length is not above 0");
  const double f = focal_length_ = -1 / c;
  const double front = f * (1 - d), rear = f * (1 - a);  // principal planes: behind the first, before the last vertex
  const double between = length - front - rear;
  // Object, lens and film share the axis: x + y = distance less what lies between the planes, 1/x + 1/y = 1/f.
  double image = f;
  if (distance < far_away) {
    const double sum = distance - between, root = sum * sum - 4 * f * sum;
    if (!(sum > 0) || root < 0)
      throw std::invalid_argument("it cannot be focused there: the least distance from the film is " +
                                  std::to_string(4 * f + between) + " m");
    image = (sum - std::sqrt(root)) / 2;
  }
  image_distance_ = image;
  const double film_to_rear = image - rear;
  if (!(film_to_rear > 0)) throw std::invalid_argument("the film would lie within it");
  place_surfaces(film_to_rear);
}

LensSystem::Bounds LensSystem::bound_pupil(float from, float to) const {
  constexpr int across = 96, along = 3;
  const float half = 1.5f * float(surfaces_.back().half_width), step = 2 * half / across, z = float(rear());
  Bounds b{{half, half}, {-half, -half}};
  for (int k = 0; k < along; ++k) {
    const V3f o(lerp(float(k) / (along - 1), from, to), 0, 0);
    for (int y = 0; y < across; ++y)
      for (int x = 0; x < across; ++x) {
        const V2f at((float(x) + 0.5f) * step - half, (float(y) + 0.5f) * step - half);
        if (at.x >= b.min.x && at.x <= b.max.x && at.y >= b.min.y && at.y <= b.max.y) continue;
        V3f unused_o, unused_d;
        if (!to_scene(o, normalize(V3f(at.x, at.y, z) - o), &unused_o, &unused_d)) continue;
        b.min = V2f(std::min(b.min.x, at.x), std::min(b.min.y, at.y));
        b.max = V2f(std::max(b.max.x, at.x), std::max(b.max.y, at.y));
      }
  }
  if (b.min.x > b.max.x) return {};
  b.min -= V2f(step, step), b.max += V2f(step, step);
  return b;
}

void LensSystem::bound_pupils() {
  for (int r = 0; r < rings; ++r)
    pupils_[size_t(r)] = bound_pupil(widest() * float(r) / rings, widest() * float(r + 1) / rings);
  if (!(pupils_[0].area() > 0)) throw std::invalid_argument("no light reaches the middle of the film through it");
}

void LensSystem::find_exposure() {
  constexpr int n = 128;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      sum += double(sample(V2f(0, 0), V2f((float(i) + 0.5f) / n, (float(k) + 0.5f) / n)).weight);
  if (!(sum > 0)) throw std::invalid_argument("no light reaches the middle of the film through it");
  exposure_ = float(sum / n / n);
}

LensSystem::Ray LensSystem::sample(const V2f& film, const V2f& u) const {
  const float r = std::sqrt(film.x * film.x + film.y * film.y);
  const Bounds& b = pupils_[size_t(std::min(int(r / widest() * rings), rings - 1))];
  const float c = r > 0 ? film.x / r : 1, s = r > 0 ? film.y / r : 0;
  const V2f at(lerp(u.x, b.min.x, b.max.x), lerp(u.y, b.min.y, b.max.y));
  const V3f o(film.x, film.y, 0), on_lens(c * at.x - s * at.y, s * at.x + c * at.y, float(rear()));
  Ray ray{V3f(0, 0, float(front())), normalize(on_lens - o), 0};
  float passes = 1;
  const float cosine = ray.d.z;
  if (!(b.area() > 0) || !to_scene(o, ray.d, &ray.o, &ray.d, &passes)) return ray;
  ray.weight = passes * sqr(sqr(cosine)) * b.area() / (sqr(float(rear())) * exposure_);
  return ray;
}

}  // namespace dapple::scene
