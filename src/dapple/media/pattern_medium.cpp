// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/pattern_medium.h"

#include <cstdio>
#include <utility>

#include "dapple/media/null_collision.h"

namespace dapple::media {
namespace {

constexpr int capacity = MediumRays::capacity;
/// Collisions of one ray, after which it is given up: bounds far above what a pattern gives can ask for any number.
constexpr int most_collisions = 1 << 15;

/// The part of o + t d in a box: false where there is none.
bool clip(const V3f& o, const V3f& d, const Box3f& box, float* first, float* end) {
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (!(o[k] >= box.min[k] && o[k] < box.max[k])) return false;
      continue;
    }
    float near = (box.min[k] - o[k]) / d[k], far = (box.max[k] - o[k]) / d[k];
    if (near > far) std::swap(near, far);
    *first = std::max(*first, near);
    *end = std::min(*end, far);
  }
  return *first < *end;
}

float most(float v) {
  return v;
}
float most(const RGB& v) {
  return v.max();
}
bool is_usable(float v) {
  return v >= 0 && v < infinity;
}
bool is_usable(const RGB& v) {
  return is_usable(v.r) && is_usable(v.g) && is_usable(v.b);
}
float cut(float v, float bound) {
  return std::min(v, bound);
}
RGB cut(const RGB& v, float bound) {
  return {cut(v.r, bound), cut(v.g, bound), cut(v.b, bound)};
}

void raise(std::atomic<float>* largest, float v) {
  float before = largest->load(std::memory_order_relaxed);
  while (before < v && !largest->compare_exchange_weak(before, v, std::memory_order_relaxed)) {
  }
}

/// All but places and times.
void set_no_surface(pattern::ShadingPoints* points, int n) {
  const V3f none(0, 0, 0);
  pattern::ShadingPoints& p = *points;
  for (int i = 0; i < n; ++i) {
    for (auto* v : {&p.dPdu, &p.dPdv, &p.dNdu, &p.dNdv, &p.dPdx, &p.dPdy, &p.Ng, &p.Ns}) v->set(i, none);
    for (auto* v : {p.u, p.v, p.dudx, p.dudy, p.dvdx, p.dvdy}) v[i] = 0;
    p.key[i] = 0;
  }
}

/// A ray under way in the box.
struct Walk {
  V3f o, d;
  float time, t, end;
  KeyedRng rng{0};
  int ray;
};

}  // namespace

PatternMedium::PatternMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase,
                             std::string name)
    : UnevenMedium(phase),
      content_(std::move(content)),
      world_to_medium_(medium_to_world.inverse()),
      name_(std::move(name)) {
  const auto bound_of = [](const auto& input, float bound) {
    return input.constant() ? most(*input.constant()) : bound;
  };
  bounds_[absorption] = bound_of(content_.sigma_a, content_.sigma_a_bound);
  bounds_[scattering] = bound_of(content_.sigma_s, content_.sigma_s_bound);
  bounds_[density] = bound_of(content_.density, content_.density_bound);
  bounds_[emission] = infinity;
  const bool constant = content_.sigma_a.constant() && content_.sigma_s.constant();
  const float sum = constant ? (*content_.sigma_a.constant() + *content_.sigma_s.constant()).max()
                             : bounds_[absorption] + bounds_[scattering];
  across_ = length(bounds().size());
  majorant_ = sum * bounds_[density] * (1 + 1e-6f);  // above what products round up to
}

template <class T>
void PatternMedium::check(Parameter parameter, int n, T* values) const {
  const float bound = bounds_[parameter];
  int above = 0, bad = 0;
  float largest = 0;
  for (int i = 0; i < n; ++i) {
    if (!is_usable(values[i])) {
      values[i] = T(0.0f);
      ++bad;
    } else if (const float v = most(values[i]); v > bound) {
      values[i] = cut(values[i], bound);
      largest = std::max(largest, v);
      ++above;
    }
  }
  if (bad > 0) counts_[parameter].bad.fetch_add(uint64_t(bad), std::memory_order_relaxed);
  if (above == 0) return;
  counts_[parameter].above.fetch_add(uint64_t(above), std::memory_order_relaxed);
  raise(&counts_[parameter].largest, largest);
}

void PatternMedium::evaluate(const pattern::ShadingPoints& points, Point* out) const {
  const int n = points.count;
  float scale[capacity];
  RGB color[capacity];
  const auto values = [&](const auto& input, Parameter parameter, auto* to) {
    if (input.constant())
      std::fill_n(to, n, *input.constant());
    else
      input.texture().evaluate(points, to), check(parameter, n, to);
  };
  values(content_.density, density, scale);
  values(content_.sigma_a, absorption, color);
  for (int i = 0; i < n; ++i) out[i].sigma_a = color[i] * scale[i];
  values(content_.sigma_s, scattering, color);
  for (int i = 0; i < n; ++i) out[i].sigma_s = color[i] * scale[i];
  values(content_.emission, emission, color);
  for (int i = 0; i < n; ++i) out[i].emission = color[i];
}

// visit(ray, t, point, rng) at each collision with the majorant says whether the ray goes on; give_up(ray) where there
// are too many. A ray's numbers are those of its key, whatever other rays do.
template <class Visit, class GiveUp>
void PatternMedium::track(const MediumRays& rays, const Visit& visit, const GiveUp& give_up) const {
  if (!(majorant_ > 0)) return;
  Walk walks[capacity];
  int n = 0;
  for (int i = 0; i < rays.count; ++i) {
    const Ray& ray = rays.ray[i];
    float first = 0, end = ray.t_max;
    if (clip(world_to_medium_.point(ray.o), world_to_medium_.vector(ray.d), content_.box, &first, &end))
      walks[n++] = {ray.o, ray.d, ray.time, first, end, KeyedRng(rays.key[i]), i};
  }
  pattern::ShadingPoints points;
  Point at[capacity];
  set_no_surface(&points, n);
  const float inverse = 1 / majorant_;
  for (int collisions = 0; n > 0; ++collisions) {
    if (collisions == most_collisions) {
      exhausted_.fetch_add(uint64_t(n), std::memory_order_relaxed);
      for (int i = 0; i < n; ++i) give_up(walks[i].ray);
      return;
    }
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      Walk& w = walks[i];
      w.t += -std::log1p(-w.rng.next()) * inverse;
      if (!(w.t < w.end)) continue;
      points.P.set(kept, w.o + w.d * w.t);
      points.time[kept] = w.time;
      walks[kept++] = w;
    }
    points.count = kept;
    if (kept > 0) evaluate(points, at);
    n = 0;
    for (int i = 0; i < kept; ++i)
      if (visit(walks[i].ray, walks[i].t, at[i], walks[i].rng)) walks[n++] = walks[i];
  }
}

void PatternMedium::coefficients(const V3f* P, float time, int n, MediumPoint* out) const {
  pattern::ShadingPoints points;
  set_no_surface(&points, n);
  int lane[capacity], inside = 0;
  for (int i = 0; i < n; ++i) {
    const V3f p = world_to_medium_.point(P[i]);
    const Box3f& box = content_.box;
    out[i] = {};
    if (!(p.x >= box.min.x && p.x < box.max.x && p.y >= box.min.y && p.y < box.max.y && p.z >= box.min.z &&
          p.z < box.max.z))
      continue;
    points.P.set(inside, P[i]);
    points.time[inside] = time;
    lane[inside++] = i;
  }
  points.count = inside;
  if (inside == 0) return;
  Point found[capacity];
  evaluate(points, found);
  for (int k = 0; k < inside; ++k) out[lane[k]] = found[k];
}

Box3f PatternMedium::bounds() const {
  const Box3f& box = content_.box;
  return bounds_of_cube(world_to_medium_.inverse() * Transform::translate(V3d(box.min)) *
                        Transform::scale(V3d(box.max - box.min)));
}

std::optional<RGB> PatternMedium::extinction_color() const {
  if (!content_.sigma_a.constant() || !content_.sigma_s.constant()) return std::nullopt;
  return color_of(*content_.sigma_a.constant() + *content_.sigma_s.constant());
}

// All of it has one bound: so many for the diagonal of the box.
int PatternMedium::stretches(const Ray& ray, float t_max, Stretch* out) const {
  float first = 0, end = t_max;
  if (!(majorant_ > 0) ||
      !clip(world_to_medium_.point(ray.o), world_to_medium_.vector(ray.d), content_.box, &first, &end))
    return 0;
  constexpr int most = most_strata / 2;
  const float across = across_;
  const int n = std::clamp(int(std::ceil(float(most) * (end - first) / across)), 1, most);
  const auto edge = [&](int i) { return i == n ? end : first + (end - first) * float(i) / float(n); };
  for (int i = 0; i < n; ++i) out[i] = {edge(i), edge(i + 1), majorant_};
  return n;
}

void PatternMedium::sample_batch(const MediumRays& rays, MediumSample* out) const {
  for (int i = 0; i < rays.count; ++i) {
    out[i] = {};
    out[i].t = rays.ray[i].t_max;
  }
  const float inverse = 1 / majorant_;
  track(
      rays,
      [&](int i, float t, const Point& p, KeyedRng& rng) {
        const Collision c = null_collision(p.sigma_a, p.sigma_s, p.emission, inverse, rays.beta[i], rng, &out[i]);
        if (c == Collision::scattered) out[i].t = t;
        return c == Collision::none;
      },
      [&](int i) { out[i].weight = RGB(0); });
}

void PatternMedium::transmittance_batch(const MediumRays& rays, RGB* out) const {
  std::fill_n(out, rays.count, RGB(1));
  const float inverse = 1 / majorant_;
  track(
      rays,
      [&](int i, float, const Point& p, KeyedRng& rng) {
        const bool on = pass_collision(p.sigma_a + p.sigma_s, inverse, rng, &out[i]);
        if (!on) out[i] = RGB(0);
        return on;
      },
      [&](int i) { out[i] = RGB(0); });
}

MediumSample PatternMedium::sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MediumRays rays;
  rays.add(ray, t_max, beta, key);
  MediumSample out;
  sample_batch(rays, &out);
  return out;
}

RGB PatternMedium::transmittance(const Ray& ray, float t_max, uint64_t key) const {
  MediumRays rays;
  rays.add(ray, t_max, RGB(1), key);
  RGB out;
  transmittance_batch(rays, &out);
  return out;
}

PatternMedium::Faults PatternMedium::faults(Parameter parameter) const {
  const Count& c = counts_[parameter];
  return {c.above.load(std::memory_order_relaxed), c.largest.load(std::memory_order_relaxed),
          c.bad.load(std::memory_order_relaxed)};
}

std::vector<std::string> PatternMedium::warnings() const {
  std::vector<std::string> warnings;
  const auto points = [](uint64_t n) { return " at " + std::to_string(n) + (n == 1 ? " point" : " points"); };
  const auto number = [](float v) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", double(v));
    return std::string(text);
  };
  for (int i = 0; i < parameter_count; ++i) {
    const auto parameter = Parameter(i);
    const Faults f = faults(parameter);
    const std::string what = name_ + ": \"" + parameter_names[i] + "\" ";
    if (f.above > 0)
      warnings.push_back(what + "was above its bound of " + number(bound(parameter)) + points(f.above) + ", up to " +
                         number(f.largest) + ": cut to the bound");
    if (f.bad > 0) warnings.push_back(what + "was negative or not finite" + points(f.bad) + ": taken as 0");
  }
  if (exhausted() > 0)
    warnings.push_back(name_ + ": " + std::to_string(exhausted()) +
                       " rays met its bound too often and count as absorbed; its bounds or its box are too large");
  return warnings;
}

}  // namespace dapple::media
