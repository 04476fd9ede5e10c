// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/scene_origin.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "dapple/base/parallel.h"
#include "dapple/scenefile/first_points.h"
#include "dapple/scenefile/placement_file.h"

namespace dapple::build {

using Imath::Box3d;
using scenefile::InstanceEntity;
using scenefile::SceneDescription;
using scenefile::ShapeEntity;
using scenefile::TransformPair;

namespace {

// Nearer than one of these an origin of 0 will do: floats are exact to 1e-6 of the extent, to 3e-5 m, to 5e-4 of it.
constexpr double extents_off = 16, nearest_origin = 256, most_extents = 4096;
/// A float's last bit is 6e-8 of it; at this ratio steps are 1/160 of a shape's size.
constexpr double least_ratio = 1e-5;

Box3d moved(const Box3d& box, const M44d& m) {
  Box3d out;
  if (box.isEmpty()) return out;
  for (int c = 0; c < 8; ++c) {
    const V3d p(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y, c & 4 ? box.max.z : box.min.z);
    V3d q;
    for (int i = 0; i < 3; ++i) q[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
    const double w = m[3][0] * p.x + m[3][1] * p.y + m[3][2] * p.z + m[3][3];
    if (w != 0 && w != 1) q *= 1 / w;
    if (std::isfinite(q.x + q.y + q.z)) out.extendBy(q);
  }
  return out;
}

Box3d moved(const Box3d& box, const TransformPair& t) {
  Box3d out = moved(box, t.start.matrix());
  if (t.is_animated()) out.extendBy(moved(box, t.end.matrix()));
  return out;
}

double largest(const V3d& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// Warns where the median shape is small for where it lies.
void warn_of_steps(const std::vector<Box3d>& boxes, const Box3d& all, const V3d& origin, const SceneDescription& d,
                   Diagnostics& diagnostics) {
  std::vector<double> ratios;
  for (const Box3d& box : boxes)
    if (const double size = largest(box.max - box.min); size > 0 && !box.isEmpty())
      ratios.push_back(size / largest(box.center() - origin));
  if (ratios.empty()) return;
  const auto middle = ratios.begin() + std::ptrdiff_t(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  if (*middle >= least_ratio) return;
  char text[640];
  std::snprintf(text, sizeof text,
                "the scene reaches from %.9g %.9g %.9g to %.9g %.9g %.9g, its origin is %.9g %.9g %.9g, and half of "
                "its shapes are smaller than %.2g "
                "of their distance from there: steps of single precision show; expected an Option \"point3 origin\" "
                "near what matters",
                all.min.x, all.min.y, all.min.z, all.max.x, all.max.y, all.max.z, origin.x, origin.y, origin.z,
                *middle);
  diagnostics.warn({d.files.empty() ? "" : std::string_view(d.files.front()), 0, 0}, text);
}

/// Boxes that a file of placements, or some of its places, give an object whose own box is `inner`.
std::vector<Box3d> placed_boxes(const SceneDescription& d, const scenefile::PlacementsEntity& p, const Box3d& inner) {
  std::vector<Box3d> boxes;
  for (const auto& placed : scenefile::PlacementFile(d.resolve(p.filename), p.loc).sample()) {
    M44d m;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) m[r][c] = placed[size_t(4 * r + c)];
    const Box3d box = inner.isEmpty() ? Box3d(V3d(0, 0, 0)) : inner;
    boxes.push_back(moved(box, (p.transform * Transform(m)).matrix()));
  }
  return boxes;
}

/// Adds to the box of a definition what stands in it, whose own boxes come first.
void extend_by_objects(const SceneDescription& d, size_t object, std::vector<uint8_t>* done,
                       std::vector<Box3d>* boxes) {
  if ((*done)[object]) return;
  (*done)[object] = 1;
  for (const InstanceEntity& i : d.objects[object].instances) {
    extend_by_objects(d, size_t(i.object), done, boxes);
    (*boxes)[object].extendBy(moved((*boxes)[size_t(i.object)], i.transform.exact()));
  }
  for (const scenefile::PlacementsEntity& p : d.objects[object].placements) {
    extend_by_objects(d, size_t(p.object), done, boxes);
    for (const Box3d& box : placed_boxes(d, p, (*boxes)[size_t(p.object)])) (*boxes)[object].extendBy(box);
  }
}

/// Boxes of the definitions, in their own spaces; their origins go to `origins`.
std::vector<Box3d> object_boxes(const SceneDescription& d, std::vector<V3d>* origins) {
  std::vector<Box3d> boxes(d.objects.size());
  parallel_for(d.objects.size(), [&](size_t i) {
    for (const ShapeEntity& e : d.objects[i].shapes) boxes[i].extendBy(moved(estimated_bounds(d, e), e.transform));
  });
  std::vector<uint8_t> done(boxes.size(), 0);
  for (size_t i = 0; i < boxes.size(); ++i) extend_by_objects(d, i, &done, &boxes);
  for (const Box3d& box : boxes) origins->push_back(origin_of(box));
  for (const InstanceEntity& i : d.instances)
    if (V3d& origin = (*origins)[size_t(i.object)]; origin != V3d(0, 0, 0) && !only_translates(i.transform.exact()))
      origin = V3d(0, 0, 0);
  for (size_t i = 0; i < boxes.size(); ++i)
    for (const ShapeEntity& e : d.objects[i].shapes)
      if (e.transform.is_animated()) (*origins)[i] = V3d(0, 0, 0);
  return boxes;
}

}  // namespace

TransformPair Origins::of_instance(const InstanceEntity& instance) const {
  const V3d& own = objects[size_t(instance.object)];
  if (scene == V3d(0, 0, 0) && own == V3d(0, 0, 0)) return instance.transform.expand();
  const TransformPair t = instance.transform.exact();
  return {with_base(in_world(t.start), own), with_base(in_world(t.end), own)};
}

Transform with_base(const Transform& m, const V3d& base) {
  return base == V3d(0, 0, 0) ? m : m * Transform::translate(base);
}

bool only_translates(const TransformPair& pair) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (pair.start.matrix()[i][j] != pair.end.matrix()[i][j]) return false;
  return true;
}

V3d origin_of(const Box3d& bounds) {
  if (bounds.isEmpty()) return V3d(0, 0, 0);
  const V3d middle = bounds.center();
  const double extent = largest(bounds.max - bounds.min);
  const double distance = largest(middle);
  if (!(distance >= std::max(extents_off * extent, std::min(nearest_origin, most_extents * extent))) || distance == 0)
    return V3d(0, 0, 0);
  constexpr double finest = 0x1p-40;  // of the distance, of what has no extent
  const double grid = std::exp2(std::ceil(std::log2(std::max(4 * extent, finest * distance))));
  V3d origin;
  for (int k = 0; k < 3; ++k) origin[k] = std::round(middle[k] / grid) * grid;
  return origin;
}

Box3d estimated_bounds(const SceneDescription& d, const ShapeEntity& e) {
  Box3d box;
  const auto parameter = [&e](std::string_view name) -> const scenefile::Param* {
    for (const scenefile::Param& p : e.params.all())
      if (p.name == name) return &p;
    return nullptr;
  };
  for (const char* name : {"P", "P1"}) {
    const scenefile::Param* p = parameter(name);
    if (!p || p->type != scenefile::ParamType::point3) continue;
    for (size_t i = 0; i + 2 < p->numbers.size(); i += 3)
      box.extendBy(p->base + V3d(p->numbers[i], p->numbers[i + 1], p->numbers[i + 2]));
  }
  if (!box.isEmpty()) return box;
  if (const scenefile::Param* p = parameter("filename"); p && p->strings.size() == 1) {
    if (e.type == "mesh" || e.type == "trianglemesh") return box;  // read by Assimp, which has floats alone
    for (const V3d& point : scenefile::first_points(d.resolve(p->strings[0]))) box.extendBy(point);
    return box;
  }
  const scenefile::Param* radius = parameter("radius");
  const double r = radius && radius->numbers.size() == 1 ? double(radius->numbers[0]) : 1;
  return Box3d(V3d(-r), V3d(r));
}

Origins find_origins(const SceneDescription& d, Diagnostics& diagnostics) {
  Origins origins;
  const std::vector<Box3d> objects = object_boxes(d, &origins.objects);
  std::vector<Box3d> boxes(d.shapes.size());
  parallel_for(d.shapes.size(),
               [&](size_t i) { boxes[i] = moved(estimated_bounds(d, d.shapes[i]), d.shapes[i].transform); });
  const size_t first = boxes.size();
  boxes.resize(first + d.instances.size());
  parallel_ranges(d.instances.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Box3d& box = objects[size_t(d.instances[i].object)];
      if (!box.isEmpty()) boxes[first + i] = moved(box, d.instances[i].transform.exact());
    }
  });
  for (const scenefile::PlacementsEntity& p : d.placements) {
    const std::vector<Box3d> placed = placed_boxes(d, p, objects[size_t(p.object)]);
    boxes.insert(boxes.end(), placed.begin(), placed.end());
  }
  Box3d all;
  for (const Box3d& box : boxes) all.extendBy(box);
  origins.scene = d.options.find("origin") ? d.options.get_point3("origin", V3d(0, 0, 0)) : origin_of(all);
  if (!all.isEmpty()) warn_of_steps(boxes, all, origins.scene, d, diagnostics);
  return origins;
}

}  // namespace dapple::build
