// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/camera_view.h"

namespace dapple::build {

using scene::Projection;

namespace {

constexpr int most_pieces = 16;  // of a line across a patch, for each pixel along the picture's longer side
constexpr float off_screen = 4, margin = 1.2f;

float largest_scale(const Transform& t) {
  return std::sqrt(
      std::max({length2(t.vector({1, 0, 0})), length2(t.vector({0, 1, 0})), length2(t.vector({0, 0, 1}))}));
}

}  // namespace

CameraView::CameraView(const scene::Camera& camera) : camera_(camera), scale_(largest_scale(camera.world_to_camera())) {
  const auto& s = camera.settings();
  if (s.projection == Projection::perspective) half_ = std::tan(radians(s.fov_degrees) / 2);
}

float CameraView::width_at(const V3f& world) const {
  const auto& s = camera_.settings();
  const V3f p = camera_.world_to_camera().point(world);
  float depth = 1;
  bool seen = true;
  if (s.projection == Projection::perspective || s.projection == Projection::orthographic) {
    if (s.projection == Projection::perspective) depth = p.z;
    const float x_middle = (s.screen_min_x + s.screen_max_x) / 2, y_middle = (s.screen_min_y + s.screen_max_y) / 2;
    const float scale = half_ * depth;
    seen = p.z > 0 && std::abs(p.x - x_middle * scale) <= margin * (s.screen_max_x - s.screen_min_x) / 2 * scale &&
           std::abs(p.y - y_middle * scale) <= margin * (s.screen_max_y - s.screen_min_y) / 2 * scale;
  } else {
    depth = length(p);
  }
  if (!seen && s.projection == Projection::perspective) depth = length(p);
  const float width = camera_.pixel_width(depth) * (seen ? 1.0f : off_screen);
  return std::max(width, std::numeric_limits<float>::min());
}

void CameraView::pixel_widths(std::span<const V3f> P, float* widths) const {
  for (size_t i = 0; i < P.size(); ++i) widths[i] = width_at(P[i]);
}

// Of a ball in camera space.
bool CameraView::may_see(const V3f& p, float radius) const {
  const auto& s = camera_.settings();
  if (!(p.z > -radius)) return false;
  const float extents[2][2] = {{s.screen_min_x, s.screen_max_x}, {s.screen_min_y, s.screen_max_y}};
  for (int axis = 0; axis < 2; ++axis)
    for (const float side : {-1.0f, 1.0f}) {
      const float edge = half_ * ((extents[axis][0] + extents[axis][1]) / 2 +
                                  side * margin * (extents[axis][1] - extents[axis][0]) / 2);
      const bool is_flat = s.projection == Projection::orthographic;
      const float beyond = is_flat ? side * (p[axis] - edge) : side * (p[axis] - edge * p.z) / std::hypot(1.0f, edge);
      if (beyond > radius) return false;
    }
  return true;
}

float CameraView::least_width(const V3f& centre, float world_radius) const {
  const V3f p = camera_.world_to_camera().point(centre);
  const float radius = world_radius * scale_;
  const Projection projection = camera_.settings().projection;
  const float nearest = std::max(length(p) - radius, 0.0f);
  float width = camera_.pixel_width(nearest);
  if (projection == Projection::perspective || projection == Projection::orthographic)
    width = may_see(p, radius) ? camera_.pixel_width(std::max(p.z - radius, 0.0f)) : off_screen * width;
  return std::max(width, std::numeric_limits<float>::min());
}

int CameraView::finest_level() const {
  const V2i r = camera_.settings().resolution;
  return int(std::ceil(std::log2(float(most_pieces) * float(std::max(r.x, r.y)))));
}

InstancesView::InstancesView(std::shared_ptr<const CameraView> world, const std::vector<Transform>& world_from_object,
                             const Box3f& bounds)
    : world_(std::move(world)) {
  for (const Transform& t : world_from_object) placements_.push_back({t, 1 / largest_scale(t)});
  if (placements_.size() <= most_placements) return;
  std::vector<std::pair<float, size_t>> nearest(placements_.size());
  const V3f centre = bounds.isEmpty() ? V3f(0, 0, 0) : bounds.center();
  const float radius = bounds.isEmpty() ? 0 : length(bounds.max - bounds.min) / 2;
  for (size_t i = 0; i < nearest.size(); ++i) {
    const Placement& p = placements_[i];
    nearest[i] = {world_->least_width(p.to_world.point(centre), radius / p.inv_scale) * p.inv_scale, i};
  }
  std::partial_sort(nearest.begin(), nearest.begin() + most_placements, nearest.end());
  std::vector<Placement> kept;
  for (size_t i = 0; i < most_placements; ++i) kept.push_back(placements_[nearest[i].second]);
  placements_ = std::move(kept);
}

void InstancesView::pixel_widths(std::span<const V3f> P, float* widths) const {
  std::fill_n(widths, P.size(), infinity);
  for (const Placement& placement : placements_)
    for (size_t i = 0; i < P.size(); ++i) {
      const V3f world = placement.to_world.point(P[i]);
      float width;
      world_->pixel_widths({&world, 1}, &width);
      widths[i] = std::min(widths[i], width * placement.inv_scale);
    }
}

}  // namespace dapple::build
