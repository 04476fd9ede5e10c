// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/grid_medium.h"

#include <array>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/media/null_collision.h"

namespace dapple::media {
namespace {

constexpr int most_majorants = 32;  // along an axis
/// Collisions of one flight, after which it counts as absorbed: grids with a spike of density can ask for any number.
constexpr int most_collisions = 1 << 15;

V3f per_axis(const V3f& a, const V3f& b) {
  return {a.x / b.x, a.y / b.y, a.z / b.z};
}

}  // namespace

/// The part of a ray in the box, as collisions with the majorant. Positions are in the unit cube; lengths are those
/// along the ray, in the world, from where it enters the box.
class GridMedium::Walk {
 public:
  Walk(const GridMedium& medium, const Ray& ray, float t_max) : medium_(medium) {
    const Box3f& box = medium.content_.box;
    const V3f size = box.max - box.min;
    o_ = per_axis(medium.world_to_medium_.point(ray.o) - box.min, size);
    d_ = per_axis(medium.world_to_medium_.vector(ray.d), size);
    float end = t_max;
    for (int k = 0; k < 3; ++k) {
      const float inverse = 1 / d_[k];
      float near = -o_[k] * inverse, far = (1 - o_[k]) * inverse;
      if (d_[k] == 0) {
        near = o_[k] >= 0 && o_[k] < 1 ? -infinity : infinity;
        far = infinity;
      }
      if (near > far) std::swap(near, far);
      first_ = std::max(first_, near);
      end = std::min(end, far);
    }
    if (!(first_ < end)) return;
    end_ = end - first_;
    o_ += d_ * first_;  // so that lengths in the box do not drown in the way to it
    enter_first_cell();
  }

  /// Goes to the next collision; false where the ray leaves the box or ends before.
  bool next(KeyedRng& rng) {
    if (++collisions_ > most_collisions) {
      medium_.exhausted_.fetch_add(1, std::memory_order_relaxed);
      return exhausted_ = true, false;
    }
    float depth = -std::log1p(-rng.next());
    while (t_ < end_) {
      const float sigma = majorant(), leave = std::min(cell_end(), end_);
      if (sigma * (leave - t_) > depth) {
        t_ = std::min(t_ + depth / sigma, leave);
        return true;
      }
      depth -= sigma * (leave - t_);
      t_ = leave;
      step();
    }
    return false;
  }

  float majorant() const {
    return medium_.majorants_[(static_cast<size_t>(cell_[2]) * medium_.majorants_y_ + cell_[1]) * medium_.majorants_x_ +
                              cell_[0]];
  }
  V3f position() const { return o_ + d_ * t_; }
  float t() const { return first_ + t_; }  ///< along the ray
  bool exhausted() const { return exhausted_; }

 private:
  void enter_first_cell() {
    const std::array<int, 3> n = {medium_.majorants_x_, medium_.majorants_y_, medium_.majorants_z_};
    const V3f p = position();
    for (int k = 0; k < 3; ++k) {
      const float at = p[k] * n[k];
      cell_[k] = std::clamp(static_cast<int>(at), 0, n[k] - 1);
      const int forward = d_[k] > 0 ? 1 : 0;
      step_[k] = d_[k] > 0 ? 1 : -1;
      limit_[k] = d_[k] > 0 ? n[k] : -1;
      crossing_[k] = d_[k] != 0 ? (static_cast<float>(cell_[k] + forward) / n[k] - o_[k]) / d_[k] : infinity;
      delta_[k] = d_[k] != 0 ? 1 / (n[k] * std::abs(d_[k])) : infinity;
    }
  }
  int axis() const {
    return crossing_[0] < crossing_[1] ? (crossing_[0] < crossing_[2] ? 0 : 2) : (crossing_[1] < crossing_[2] ? 1 : 2);
  }
  float cell_end() const { return std::max(crossing_[axis()], t_); }
  void step() {
    if (t_ >= end_) return;
    const int k = axis();
    cell_[k] += step_[k];
    crossing_[k] += delta_[k];
    if (cell_[k] == limit_[k]) t_ = end_;
  }

  const GridMedium& medium_;
  V3f o_, d_;
  float first_ = 0;        // way to the box
  float t_ = 0, end_ = 0;  // from there
  std::array<int, 3> cell_{}, step_{}, limit_{};
  std::array<float, 3> crossing_{}, delta_{};
  int collisions_ = 0;
  bool exhausted_ = false;
};

GridMedium::GridMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name)
    : Medium(phase), content_(std::move(content)), world_to_medium_(medium_to_world.inverse()), name_(std::move(name)) {
  build_majorants();
}

GridMedium::Point GridMedium::at(const V3f& p) const {
  const float density = content_.density.empty() ? 1 : content_.density.lookup(p);
  Point out{content_.sigma_a * density, content_.sigma_s * density, content_.emission};
  if (!content_.sigma_a_grid.empty()) out.sigma_a *= content_.sigma_a_grid.lookup(p);
  if (!content_.sigma_s_grid.empty()) out.sigma_s *= content_.sigma_s_grid.lookup(p);
  if (out.emission.is_black()) return out;
  if (!content_.emission_scale.empty()) out.emission *= content_.emission_scale.lookup(p);
  if (!content_.emission_rgb.empty()) out.emission *= content_.emission_rgb.lookup(p);
  return out;
}

void GridMedium::build_majorants() {
  const auto cells = [this](auto size) {
    const int finest = std::max({size(content_.density), size(content_.sigma_a_grid), size(content_.sigma_s_grid)});
    return std::clamp(finest, 1, most_majorants);
  };
  majorants_x_ = cells([](const auto& g) { return g.nx(); });
  majorants_y_ = cells([](const auto& g) { return g.ny(); });
  majorants_z_ = cells([](const auto& g) { return g.nz(); });
  const auto largest = [](const VoxelGrid<RGB>& grid, const V3f& lo, const V3f& hi, RGB scale) {
    if (grid.empty()) return scale;
    RGB most;
    grid.visit_box(lo, hi, [&most](RGB v) {
      for (int c = 0; c < 3; ++c) most[c] = std::max(most[c], v[c]);
    });
    return most * scale;
  };
  for (int z = 0; z < majorants_z_; ++z)
    for (int y = 0; y < majorants_y_; ++y)
      for (int x = 0; x < majorants_x_; ++x) {
        // A little wider, for positions that round across the border.
        const V3f n(majorants_x_, majorants_y_, majorants_z_), slack(1e-4f, 1e-4f, 1e-4f);
        const V3f lo = per_axis(V3f(x, y, z) - slack, n), hi = per_axis(V3f(x + 1, y + 1, z + 1) + slack, n);
        float density = content_.density.empty() ? 1 : 0;
        content_.density.visit_box(lo, hi, [&density](float v) { density = std::max(density, v); });
        const RGB sigma_t = largest(content_.sigma_a_grid, lo, hi, content_.sigma_a) +
                            largest(content_.sigma_s_grid, lo, hi, content_.sigma_s);
        majorants_.push_back(sigma_t.max() * density * (1 + 1e-5f));  // above what interpolation rounds up to
      }
}

MediumSample GridMedium::sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MediumSample out;
  KeyedRng rng(key);
  Walk walk(*this, ray, t_max);
  while (walk.next(rng)) {
    const float inverse = 1 / walk.majorant();
    const Point p = at(walk.position());
    const Collision collision = null_collision(p.sigma_a, p.sigma_s, p.emission, inverse, beta, rng, &out);
    if (collision == Collision::none) continue;
    out.t = collision == Collision::scattered ? walk.t() : t_max;
    return out;
  }
  if (walk.exhausted()) out.weight = RGB(0);
  out.t = t_max;
  return out;
}

RGB GridMedium::transmittance(const Ray& ray, float t_max, uint64_t key) const {
  RGB out(1);
  KeyedRng rng(key);
  Walk walk(*this, ray, t_max);
  while (walk.next(rng)) {
    const Point p = at(walk.position());
    if (!pass_collision(p.sigma_a + p.sigma_s, 1 / walk.majorant(), rng, &out)) return RGB(0);
  }
  return walk.exhausted() ? RGB(0) : out;
}

std::vector<std::string> GridMedium::warnings() const {
  if (exhausted() == 0) return {};
  return {name_ + ": " + std::to_string(exhausted()) +
          " rays met its largest extinction too often and count as absorbed; it differs too much between channels or "
          "places"};
}

}  // namespace dapple::media
