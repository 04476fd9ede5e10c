// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/motion.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/swept_box.h"
#include "dapple/scene/scene.h"

namespace dapple::scene {

using trace::no_id;

namespace {

constexpr float most_turn = pi / 12;  // within a segment
// Cells that something crosses within a segment: of those that are seen, which its motion blurs, unless the camera
// follows it; and of those that diffuse rays read, which are wide.
constexpr float most_cells = 8, most_cells_followed = 1, most_wide_cells = 4;
constexpr int most_segments = 8;        // of what moves, and of what diffuse rays read
constexpr float most_sizes = 1.0f / 3;  // of itself that something goes within a segment of what it hides
constexpr int most_passages = 32;

float angle(const V3f& a, const V3f& b) {
  const float scale = std::sqrt(length2(a) * length2(b));
  return scale > 0 ? std::acos(std::clamp(dot(a, b) / scale, -1.0f, 1.0f)) : 0;
}

// Of the rotation from one map to another, whose columns stay about as long as they are.
float angle(const float a[3][4], const float b[3][4]) {
  float trace = 0;
  for (int j = 0; j < 3; ++j) trace += std::cos(angle(V3f(a[0][j], a[1][j], a[2][j]), V3f(b[0][j], b[1][j], b[2][j])));
  return std::acos(std::clamp((trace - 1) / 2, -1.0f, 1.0f));
}

V3f mapped(const float m[3][4], const V3f& p) {
  V3f out;
  for (int i = 0; i < 3; ++i) out[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
  return out;
}

V3f face_normal(const geom::Mesh& mesh, uint32_t face, float time) {
  V3f c[4];
  mesh.corners_at(face, time, c);
  return cross(c[1] - c[0], c[2] - c[0]);
}

template <class Point>
V3f cell_normal(const geom::GridMesh::Grid& grid, size_t x, size_t y, const Point& point) {
  const size_t corner = grid.first + y * grid.stride + x;
  return cross(point(corner + 1) - point(corner), point(corner + grid.stride) - point(corner));
}

}  // namespace

Motion::Motion(const Scene& scene)
    : open_(scene.camera.settings().time_open), close_(scene.camera.settings().time_close) {
  const trace::TracedScene& traced = scene.traced;
  const size_t geometries = traced.geometry_count(), instances = traced.single_count();
  bool deforms = false, travels = false;
  std::vector<Amount> of_geometry(geometries);
  for (uint32_t g = 0; g < geometries; ++g) deforms |= (of_geometry[g] = deformation(traced.shape(g))).travel > 0;
  if (deforms) of_geometry_ = std::move(of_geometry);
  for (uint32_t i = 0; i < instances; ++i) travels |= traced.is_animated(i);
  if (travels) of_instance_.resize(instances);
  if (deforms)
    for (uint32_t i = 0; i < instances; ++i) scale_.push_back(traced.instance_scale(i));
  if (deforms || travels)
    for (uint32_t i = 0; i < instances; ++i) {
      const Amount moved = add_instance(traced, i);
      if (travels) of_instance_[i] = moved;
    }
  if (deforms)
    for (const uint32_t g : traced.geometries_in(no_id))
      if (of_geometry_[g].travel > 0) {
        const Box3f box = trace::bounds_of(traced.shape(g));
        add_passage(box, of_geometry_[g].travel, box, 1);
      }
  surfaces_move_ = !passages_.empty();
  for (const auto& light : scene.lights) {
    if (!light->moves()) continue;
    any_ = true;
    const auto bounds = light->bounds();
    if (bounds) passages_.push_back({bounds->box, length(bounds->box.max - bounds->box.min), 0, false});
  }
  camera_moves_ = scene.camera.settings().camera_to_world.is_animated();
  any_ = (surfaces_move_ || any_) && close_ > open_;
  for (const Passage& p : passages_) longest_travel_ = std::max(longest_travel_, p.travel);
  std::vector<Passage> merged;
  merge_passages(0, passages_.size(), most_passages, &merged);
  passages_ = std::move(merged);
}

// How far the vertices of a shape move, and its faces turn, in its own space.
Motion::Amount Motion::deformation(const trace::Shape& shape) const {
  Amount out;
  const auto add = [&](const auto& mesh) {
    for (size_t i = 0; i < mesh.P_end.size(); ++i) out.travel = std::max(out.travel, length(mesh.P_end[i] - mesh.P[i]));
  };
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape); mesh && !(*mesh)->P_end.empty()) {
    add(**mesh);
    for (uint32_t f = 0; f < (*mesh)->face_count(); ++f)
      out.turn = std::max(out.turn, angle(face_normal(**mesh, f, 0), face_normal(**mesh, f, 1)));
  } else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape); grids && !(*grids)->P_end.empty()) {
    const geom::GridMesh& m = **grids;
    add(m);
    for (const geom::GridMesh::Grid& grid : m.grids)
      for (size_t y = 0; y + 1 < grid.rows; ++y)
        for (size_t x = 0; x + 1 < grid.columns; ++x)
          out.turn = std::max(out.turn, angle(cell_normal(grid, x, y, [&m](size_t i) { return m.P[i]; }),
                                              cell_normal(grid, x, y, [&m](size_t i) { return m.P_end[i]; })));
  }
  out.travel *= close_ - open_, out.turn *= close_ - open_;
  return out;
}

// What an instance does beside the deformation of its geometries. Notes where it passes, these included.
Motion::Amount Motion::add_instance(const trace::TracedScene& traced, uint32_t instance) {
  Box3f box;
  float deformed = 0;
  for (const uint32_t g : traced.geometries_in(traced.object_of(instance))) {
    box.extendBy(trace::bounds_of(traced.shape(g)));
    if (!of_geometry_.empty()) deformed = std::max(deformed, of_geometry_[g].travel);
  }
  if (box.isEmpty() || (!traced.is_animated(instance) && deformed == 0)) return {};
  Amount moved;
  const auto rows = [&](float u, float m[3][4]) { traced.instance_rows(instance, lerp(u, open_, close_), m); };
  const Box3f passage = swept_box(
      box,
      [&](float u, const V3f& p) {
        float m[3][4];
        rows(u, m);
        return mapped(m, p);
      },
      &moved.travel);
  float at[3][3][4];
  for (int i = 0; i < 3; ++i) rows(float(i) / 2, at[i]);
  moved.turn = angle(at[0], at[1]) + angle(at[1], at[2]);
  const float travel = moved.travel + deformed * traced.instance_scale(instance);
  if (travel > 0) add_passage(passage, travel, box, traced.instance_scale(instance));
  return traced.is_animated(instance) ? moved : Amount();
}

// Notes where something passes, whose own box is `box` before it is scaled.
void Motion::add_passage(const Box3f& passage, float travel, const Box3f& box, float scale) {
  const float size = length(box.max - box.min) * (scale / std::numbers::sqrt3_v<float>);
  passages_.push_back({passage, travel, travel / std::max(size, 1e-30f)});
}

// Few boxes around many: halves along the widest axis.
void Motion::merge_passages(size_t first, size_t last, int leaves, std::vector<Passage>* out) {
  if (first == last) return;
  Box3f all;
  float travel = 0, sizes = 0;
  bool hides = false;
  for (size_t i = first; i < last; ++i) {
    all.extendBy(passages_[i].box);
    travel = std::max(travel, passages_[i].travel);
    sizes = std::max(sizes, passages_[i].sizes);
    hides |= passages_[i].hides;
  }
  if (leaves == 1 || last - first == 1) {
    out->push_back({all, travel, sizes, hides});
    return;
  }
  const int axis = int(all.majorAxis());
  const size_t middle = (first + last) / 2;
  std::stable_sort(passages_.begin() + std::ptrdiff_t(first), passages_.begin() + std::ptrdiff_t(last),
                   [axis](const Passage& a, const Passage& b) {
                     return a.box.min[axis] + a.box.max[axis] < b.box.min[axis] + b.box.max[axis];
                   });
  merge_passages(first, middle, leaves / 2, out);
  merge_passages(middle, last, leaves / 2, out);
}

Motion::Amount Motion::amount(uint32_t instance, uint32_t geometry) const {
  Amount a;
  if (!of_geometry_.empty()) {
    a = of_geometry_[geometry];
    if (instance < scale_.size()) a.travel *= scale_[instance];
  }
  if (instance < of_instance_.size()) a.travel += of_instance_[instance].travel, a.turn += of_instance_[instance].turn;
  return a;
}

uint8_t Motion::span_at(float segments, float time, int most) const {
  if (!(segments > 1)) return 0;
  const auto wanted = uint32_t(std::ceil(std::min(segments, float(max_segments))));
  const int count = int(std::min(std::bit_ceil(wanted), std::bit_floor(uint32_t(std::max(most, 1)))));
  const float x = (time - open_) / (close_ - open_) * float(count);
  return uint8_t(count - 1 + std::clamp(int(x), 0, count - 1));
}

uint8_t Motion::span(uint32_t instance, uint32_t geometry, float width, float time) const {
  if (!surfaces_move_) return 0;
  const Amount a = amount(instance, geometry);
  return a.travel > 0 ? span_at(std::max(a.turn / most_turn, a.travel / (most_cells * width)), time, most_segments) : 0;
}

uint8_t Motion::span_seen(const V3f& o, const V3f& d, float t, float width, float time, int most) const {
  if (!any_) return 0;
  if (camera_moves_) return span_at(longest_travel_ / (most_cells_followed * width), time, most);
  float travel = 0, sizes = 0;
  for (const Passage& p : passages_) {
    if (!p.hides || (p.travel <= travel && p.sizes <= sizes)) continue;
    float near = 0, far = t;
    for (int axis = 0; axis < 3; ++axis) {
      const float inverse = 1 / d[axis], a = (p.box.min[axis] - o[axis]) * inverse,
                  b = (p.box.max[axis] - o[axis]) * inverse;
      near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
    }
    if (near <= far) travel = std::max(travel, p.travel), sizes = std::max(sizes, p.sizes);
  }
  return span_at(std::min(std::max(travel / (most_cells * width), sizes / most_sizes), travel / width), time, most);
}

uint8_t Motion::span_near(const V3f& at, float width, float time, int most) const {
  if (!any_) return 0;
  float travel = 0;
  for (const Passage& p : passages_) {
    V3f apart;
    for (int axis = 0; axis < 3; ++axis)
      apart[axis] = std::max({p.box.min[axis] - at[axis], at[axis] - p.box.max[axis], 0.0f});
    if (length2(apart) < length2(p.box.max - p.box.min)) travel = std::max(travel, p.travel);
  }
  return span_at(travel / (most_wide_cells * width), time, std::min(most, most_segments));
}

}  // namespace dapple::scene
