// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/aggregate_pruning.h"

#include <algorithm>
#include <bit>

#include "dapple/base/hash.h"
#include "dapple/geom/mesh_components.h"
#include "dapple/vegetation/component_shape.h"
#include "dapple/vegetation/pruning_numbers.h"

namespace dapple::vegetation {

using geom::Mesh;
using geom::MeshComponents;

namespace {

// Of a component what clusters need to know.
struct Detail {
  uint32_t component;
  uint64_t code = 0;  // Morton's, of its centre
  float pixel = 0;    // width of a pixel at its centre
  bool is_long = false;
  float size = 0;  // that grows: the width of long ones, else the diameter
  double area = 0, volume = 0;
  V3f centre{0, 0, 0};
  Box3f bounds{};
};

// What becomes of a component.
struct Fate {
  bool is_kept = true;
  double area = 0;  // to grow to; 0: it stays as it is
};

bool is_long(const ComponentShape& shape) {
  return shape.length() > PruningNumbers::elongated * shape.width();
}

uint64_t spread_bits(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

uint64_t morton_code(const V3d& p, const Box3f& box) {
  const V3f size = box.max - box.min;
  const double cell = std::max({size.x, size.y, size.z}) / double((1 << 21) - 1);
  const auto cell_of = [&](int axis) { return uint64_t(std::max((p[axis] - double(box.min[axis])) / cell, 0.0)); };
  return spread_bits(cell_of(0)) | spread_bits(cell_of(1)) << 1 | spread_bits(cell_of(2)) << 2;
}

std::vector<Detail> details_of(const Mesh& mesh, const MeshComponents& components) {
  Box3f box;
  for (const V3f& p : mesh.P) box.extendBy(p);
  const float largest = length(box.max - box.min) * PruningNumbers::largest_component;
  std::vector<Detail> details;
  for (uint32_t c = 0; c < components.count(); ++c) {
    const ComponentShape shape(mesh, mesh.P, components.faces(c));
    const V3f diagonal = shape.bounds().max - shape.bounds().min;
    if (!(shape.area() > 0) || length(diagonal) > largest) continue;
    Detail d{c};
    d.code = morton_code(shape.centre(), box);
    d.is_long = is_long(shape);
    d.size = float(d.is_long ? shape.width() : 2 * shape.radius());
    d.area = shape.area(), d.volume = shape.volume();
    d.centre = V3f(shape.centre()), d.bounds = shape.bounds();
    details.push_back(d);
  }
  std::sort(details.begin(), details.end(), [](const Detail& a, const Detail& b) {
    return a.code != b.code ? a.code < b.code : a.component < b.component;
  });
  return details;
}

void find_pixels(const geom::DicingView& view, std::vector<Detail>* details) {
  std::vector<V3f> centres;
  for (const Detail& d : *details) centres.push_back(d.centre);
  std::vector<float> widths(centres.size());
  view.pixel_widths(centres, widths.data());
  for (size_t i = 0; i < widths.size(); ++i) (*details)[i].pixel = widths[i];
}

// Sums over the details of a cluster.
struct Cluster {
  double area, volume;
  Box3f bounds;
  float pixel;  // the narrowest
  const Detail* drawn;

  explicit Cluster(const Detail& d) : area(d.area), volume(d.volume), bounds(d.bounds), pixel(d.pixel), drawn(&d) {}
  // Draws by area.
  void add(const Cluster& o, uint64_t key) {
    if (double(to_unit_float(key)) * (area + o.area) >= area) drawn = o.drawn;
    area += o.area, volume += o.volume;
    bounds.extendBy(o.bounds);
    pixel = std::min(pixel, o.pixel);
  }
  bool is_solid() const {
    const V3d d(bounds.max - bounds.min);
    return volume > PruningNumbers::most_filled * d.x * d.y * d.z;
  }
};

// Walks the tree of Morton codes from its leaves up; clusters that may be merged take the place of those in them.
class Merging {
 public:
  Merging(const std::vector<Detail>& details, float pixels, std::vector<Fate>* fates)
      : details_(details), pixels_(pixels), fates_(*fates) {}

  void run() {
    for (const Detail& d : details_) fates_[d.component].is_kept = false;
    gather(0, details_.size());
    for (const Merged& m : merged_) {
      Fate& fate = fates_[m.detail->component];
      fate.is_kept = true;
      fate.area = m.area;
    }
  }

 private:
  struct Merged {
    const Detail* detail;
    double area;  // 0: it stands for itself
  };

  Cluster gather(size_t begin, size_t end) {
    if (end - begin == 1) {
      merged_.push_back({&details_[begin], 0});
      return Cluster(details_[begin]);
    }
    const size_t before = merged_.size(), middle = split(begin, end);
    Cluster cluster = gather(begin, middle);
    cluster.add(gather(middle, end), hash(begin, end));
    if (may_merge(cluster)) {
      merged_.resize(before);
      merged_.push_back({cluster.drawn, cluster.area});
    }
    return cluster;
  }

  // At the highest bit in which codes differ.
  size_t split(size_t begin, size_t end) const {
    const uint64_t differing = details_[begin].code ^ details_[end - 1].code;
    if (differing == 0) return begin + (end - begin) / 2;
    const uint64_t bit = std::bit_floor(differing);
    const auto at = std::partition_point(details_.begin() + ptrdiff_t(begin), details_.begin() + ptrdiff_t(end),
                                         [bit](const Detail& d) { return (d.code & bit) == 0; });
    return size_t(at - details_.begin());
  }

  bool may_merge(const Cluster& c) const {
    const double growth = c.area / c.drawn->area;
    const double size = double(c.drawn->size) * (c.drawn->is_long ? growth : std::sqrt(growth));
    const double most = double(pixels_) * double(c.pixel);
    return size <= most && double(length(c.bounds.max - c.bounds.min)) <= PruningNumbers::most_spread * most &&
           !c.is_solid();
  }

  const std::vector<Detail>& details_;
  const float pixels_;
  std::vector<Fate>& fates_;
  std::vector<Merged> merged_;
};

template <class T>
std::vector<T> picked(const std::vector<T>& from, const std::vector<uint32_t>& which) {
  std::vector<T> out;
  if (from.empty()) return out;
  out.reserve(which.size());
  for (const uint32_t i : which) out.push_back(from[i]);
  return out;
}

// Of the mesh the faces that are marked, and the vertices that these use, in their order.
Mesh part_of(const Mesh& mesh, const std::vector<uint8_t>& keep) {
  const size_t corners = size_t(mesh.corners);
  std::vector<uint32_t> faces, vertices, number(mesh.P.size(), 0);
  for (uint32_t f = 0; f < keep.size(); ++f)
    if (keep[f]) faces.push_back(f);
  for (const uint32_t f : faces)
    for (size_t i = 0; i < corners; ++i) number[mesh.indices[f * corners + i]] = 1;
  for (uint32_t v = 0; v < number.size(); ++v)
    if (number[v]) number[v] = uint32_t(vertices.size()), vertices.push_back(v);
  Mesh out;
  out.corners = mesh.corners;
  out.flip = mesh.flip;
  out.indices.reserve(faces.size() * corners);
  for (const uint32_t f : faces)
    for (size_t i = 0; i < corners; ++i) out.indices.push_back(number[mesh.indices[f * corners + i]]);
  out.P = picked(mesh.P, vertices), out.P_end = picked(mesh.P_end, vertices);
  out.N = picked(mesh.N, vertices), out.uv = picked(mesh.uv, vertices);
  out.source_face = picked(mesh.source_face, faces);
  return out;
}

// How a component grows.
struct Growth {
  bool is_long;
  double k;
};

// Moves the vertices of a component in P.
void grow(const std::vector<uint32_t>& vertices, const std::vector<V3f>& before, const ComponentShape& shape,
          const Growth& growth, std::vector<V3f>* P) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    const V3d p = growth.is_long ? shape.widened(before[i], growth.k) : shape.scaled(before[i], growth.k);
    (*P)[vertices[i]] = V3f(p);
  }
}

void grow(Mesh* mesh, std::span<const uint32_t> faces, const Fate& fate) {
  std::vector<uint32_t> vertices;
  const size_t corners = size_t(mesh->corners);
  for (const uint32_t f : faces)
    vertices.insert(vertices.end(), &mesh->indices[f * corners], &mesh->indices[f * corners] + corners);
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());

  const ComponentShape shape(*mesh, mesh->P, faces);
  const std::vector<V3f> before = picked(mesh->P, vertices);
  const double ratio = fate.area / shape.area();
  Growth growth{is_long(shape), is_long(shape) ? ratio : std::sqrt(ratio)};
  grow(vertices, before, shape, growth, &mesh->P);
  if (growth.is_long) {  // ends and bends do not grow with k
    growth.k *= fate.area / ComponentShape(*mesh, mesh->P, faces).area();
    grow(vertices, before, shape, growth, &mesh->P);
    for (size_t i = 0; !mesh->N.empty() && i < vertices.size(); ++i)
      mesh->N[vertices[i]] = shape.widened_normal(before[i], mesh->N[vertices[i]], growth.k);
  }
  if (mesh->P_end.empty()) return;
  const ComponentShape at_close(*mesh, mesh->P_end, faces);
  grow(vertices, picked(mesh->P_end, vertices), at_close, growth, &mesh->P_end);
}

}  // namespace

bool prune(Mesh* mesh, const geom::DicingView& view, float pixels, PruningCounts* counts) {
  if (mesh->face_count() < PruningNumbers::least_components) return false;
  const MeshComponents components(*mesh);
  if (components.count() < PruningNumbers::least_components) return false;
  std::vector<Detail> details = details_of(*mesh, components);
  if (details.size() < PruningNumbers::least_components) return false;
  find_pixels(view, &details);
  std::vector<Fate> fates(components.count());
  Merging(details, pixels, &fates).run();

  std::vector<uint8_t> keep(mesh->face_count());
  size_t kept = 0;
  for (uint32_t c = 0; c < fates.size(); ++c) {
    if (!fates[c].is_kept) continue;
    ++kept;
    for (const uint32_t f : components.faces(c)) keep[f] = 1;
    if (fates[c].area > 0) grow(mesh, components.faces(c), fates[c]);
  }
  PruningCounts found{fates.size(), kept, mesh->face_count(), 0, mesh->bytes(), 0};
  if (kept < fates.size()) *mesh = part_of(*mesh, keep);
  found.faces_kept = mesh->face_count(), found.bytes_kept = mesh->bytes();
  *counts += found;
  return kept < fates.size();
}

}  // namespace dapple::vegetation
