// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/grid_medium.h"

#include <algorithm>
#include <utility>

namespace dapple::media {
namespace {

constexpr int most_majorants = 32;  // along an axis

V3f per_axis(const V3f& a, const V3f& b) {
  return {a.x / b.x, a.y / b.y, a.z / b.z};
}

}  // namespace

GridMedium::GridMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name)
    : UnevenMedium(phase),
      content_(std::move(content)),
      world_to_medium_(medium_to_world.inverse()),
      name_(std::move(name)) {
  build_majorants();
  scatters_ = any_scattering();
  if (content_.temperature.empty()) return;
  content_.emission = RGB(0);
  float most = 0;
  content_.temperature.visit_box(V3f(0, 0, 0), V3f(1, 1, 1), [&most](float v) { most = std::max(most, v); });
  glow_.emplace((most - content_.temperature_offset) * content_.temperature_scale);
  if (glow_->is_black()) glow_.reset();
}

MajorantWalk GridMedium::walk(const Ray& ray, float t_max) const {
  const Box3f& box = content_.box;
  const V3f size = box.max - box.min;
  return {majorants_, per_axis(world_to_medium_.point(ray.o) - box.min, size),
          per_axis(world_to_medium_.vector(ray.d), size), t_max};
}

MediumPoint GridMedium::at(const V3f& p) const {
  const float density = content_.density.empty() ? 1 : content_.density.lookup(p);
  MediumPoint out{content_.sigma_a * density, content_.sigma_s * density, content_.emission};
  if (!content_.sigma_a_grid.empty()) out.sigma_a *= content_.sigma_a_grid.lookup(p);
  if (!content_.sigma_s_grid.empty()) out.sigma_s *= content_.sigma_s_grid.lookup(p);
  if (glow_)
    out.emission =
        (*glow_)((content_.temperature.lookup(p) - content_.temperature_offset) * content_.temperature_scale);
  if (out.emission.is_black()) return out;
  if (!content_.emission_scale.empty()) out.emission *= content_.emission_scale.lookup(p);
  if (!content_.emission_rgb.empty()) out.emission *= content_.emission_rgb.lookup(p);
  return out;
}

// Looks at all voxels.
bool GridMedium::any_scattering() const {
  if (content_.sigma_s.is_black() || content_.sigma_s_grid.empty()) return !content_.sigma_s.is_black();
  bool any = false;
  content_.sigma_s_grid.visit_box(V3f(0, 0, 0), V3f(1, 1, 1),
                                  [&](const RGB& v) { any |= !(v * content_.sigma_s).is_black(); });
  return any;
}

V3f GridMedium::to_cube(const V3f& P) const {
  return per_axis(world_to_medium_.point(P) - content_.box.min, content_.box.max - content_.box.min);
}

void GridMedium::coefficients(const V3f* P, float, int n, MediumPoint* out) const {
  for (int i = 0; i < n; ++i) {
    const V3f p = to_cube(P[i]);
    out[i] = is_in_cube(p) ? at(p) : MediumPoint{};
  }
}

Box3f GridMedium::bounds() const {
  const V3d size(content_.box.max - content_.box.min);
  return bounds_of_cube(world_to_medium_.inverse() * Transform::translate(V3d(content_.box.min)) *
                        Transform::scale(size));
}

std::optional<RGB> GridMedium::extinction_color() const {
  if (!content_.sigma_a_grid.empty() || !content_.sigma_s_grid.empty()) return std::nullopt;
  return color_of(content_.sigma_a + content_.sigma_s);
}

int GridMedium::stretches(const Ray& ray, float t_max, Stretch* out) const {
  return UnevenMedium::stretches(walk(ray, t_max), out);
}

void GridMedium::build_majorants() {
  const auto cells = [this](auto size) {
    const int finest = std::max({size(content_.density), size(content_.sigma_a_grid), size(content_.sigma_s_grid)});
    return std::clamp(finest, 1, most_majorants);
  };
  majorants_.nx = cells([](const auto& g) { return g.nx(); });
  majorants_.ny = cells([](const auto& g) { return g.ny(); });
  majorants_.nz = cells([](const auto& g) { return g.nz(); });
  const auto largest = [](const VoxelGrid<RGB>& grid, const V3f& lo, const V3f& hi, RGB scale) {
    if (grid.empty()) return scale;
    RGB most;
    grid.visit_box(lo, hi, [&most](RGB v) {
      for (int c = 0; c < 3; ++c) most[c] = std::max(most[c], v[c]);
    });
    return most * scale;
  };
  for (int z = 0; z < majorants_.nz; ++z)
    for (int y = 0; y < majorants_.ny; ++y)
      for (int x = 0; x < majorants_.nx; ++x) {
        // A little wider, for positions that round across the border.
        const V3f n(majorants_.nx, majorants_.ny, majorants_.nz), slack(1e-4f, 1e-4f, 1e-4f);
        const V3f lo = per_axis(V3f(x, y, z) - slack, n), hi = per_axis(V3f(x + 1, y + 1, z + 1) + slack, n);
        float density = content_.density.empty() ? 1 : 0;
        content_.density.visit_box(lo, hi, [&density](float v) { density = std::max(density, v); });
        const RGB sigma_t = largest(content_.sigma_a_grid, lo, hi, content_.sigma_a) +
                            largest(content_.sigma_s_grid, lo, hi, content_.sigma_s);
        majorants_.values.push_back(sigma_t.max() * density * (1 + 1e-5f));  // above what interpolation rounds up to
      }
}

MediumSample GridMedium::sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MajorantWalk along = walk(ray, t_max);
  const MediumSample out = fly(&along, t_max, beta, key, [this](const V3f& p) { return at(p); });
  given_up_.add(along);
  return out;
}

RGB GridMedium::transmittance(const Ray& ray, float t_max, uint64_t key) const {
  MajorantWalk along = walk(ray, t_max);
  const RGB out = track_transmittance(&along, key, [this](const V3f& p) {
    const MediumPoint point = at(p);
    return point.sigma_a + point.sigma_s;
  });
  given_up_.add(along);
  return out;
}

}  // namespace dapple::media
