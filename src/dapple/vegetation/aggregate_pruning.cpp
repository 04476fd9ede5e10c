// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/aggregate_pruning.h"

#include <algorithm>
#include <array>
#include <bit>

#include "dapple/base/hash.h"
#include "dapple/geom/mesh_components.h"
#include "dapple/numeric/morton.h"
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
  std::array<float, 6> covariance{};  // of its area: xx yy zz xy xz yz
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

float size_of(const ComponentShape& shape, bool is_long) {
  return float(is_long ? shape.width() : 2 * shape.radius());
}

uint64_t morton_code(const V3d& p, const Box3f& box) {
  const V3f size = box.max - box.min;
  const double cell = std::max({size.x, size.y, size.z}) / double((1 << 21) - 1);
  const auto cell_of = [&](int axis) { return uint64_t(std::max((p[axis] - double(box.min[axis])) / cell, 0.0)); };
  return spread_bits_by_3(cell_of(0)) | spread_bits_by_3(cell_of(1)) << 1 | spread_bits_by_3(cell_of(2)) << 2;
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
    d.size = size_of(shape, d.is_long);
    d.area = shape.area();
    if (shape.volume() > PruningNumbers::least_closed * std::pow(d.area, 1.5)) d.volume = shape.volume();
    const Imath::M33d& m = shape.covariance();
    d.covariance = {float(m[0][0]), float(m[1][1]), float(m[2][2]), float(m[0][1]), float(m[0][2]), float(m[1][2])};
    d.centre = V3f(shape.centre()), d.bounds = shape.bounds();
    details.push_back(d);
  }
  std::sort(details.begin(), details.end(), [](const Detail& a, const Detail& b) {
    return a.code != b.code ? a.code < b.code : a.component < b.component;
  });
  return details;
}

// Where vertices move, of the two ends of the shutter the larger size and the narrower pixel count.
void find_pixels(const Mesh& mesh, const MeshComponents& components, const geom::DicingView& view,
                 std::vector<Detail>* details) {
  std::vector<V3f> centres;
  for (const Detail& d : *details) centres.push_back(d.centre);
  std::vector<float> widths(centres.size());
  view.pixel_widths(centres, widths.data());
  for (size_t i = 0; i < widths.size(); ++i) (*details)[i].pixel = widths[i];
  if (mesh.P_end.empty()) return;
  for (size_t i = 0; i < centres.size(); ++i) {
    Detail& d = (*details)[i];
    const ComponentShape at_close(mesh, mesh.P_end, components.faces(d.component));
    centres[i] = V3f(at_close.centre());
    d.size = std::max(d.size, size_of(at_close, d.is_long));
  }
  view.pixel_widths(centres, widths.data());
  for (size_t i = 0; i < widths.size(); ++i) (*details)[i].pixel = std::min((*details)[i].pixel, widths[i]);
}

// Sums over the details of a cluster.
struct Cluster {
  double area, volume;
  V3d centre;
  std::array<double, 6> covariance;
  Box3f bounds;
  float pixel;  // the narrowest
  const Detail* drawn;

  explicit Cluster(const Detail& d)
      : area(d.area), volume(d.volume), centre(d.centre), bounds(d.bounds), pixel(d.pixel), drawn(&d) {
    std::copy(d.covariance.begin(), d.covariance.end(), covariance.begin());
  }
  // Draws by area.
  void add(const Cluster& o, uint64_t key) {
    if (double(to_unit_float(key)) * (area + o.area) >= area) drawn = o.drawn;
    const double share = o.area / (area + o.area);
    const V3d d = o.centre - centre;
    const double between[] = {d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z};
    for (size_t i = 0; i < covariance.size(); ++i)
      covariance[i] += share * (o.covariance[i] - covariance[i] + (1 - share) * between[i]);
    centre += d * share;
    area += o.area, volume += o.volume;
    bounds.extendBy(o.bounds);
    pixel = std::min(pixel, o.pixel);
  }
  bool is_solid() const {
    // A box of sides s has variances of s^2 / 12; their product is the determinant, whatever way it is turned.
    const auto& [xx, yy, zz, xy, xz, yz] = covariance;
    const double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    return volume > PruningNumbers::most_filled * std::sqrt(1728 * std::max(determinant, 0.0));
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

// A component that is to grow to an area.
class Growing {
 public:
  Growing(Mesh* mesh, std::span<const uint32_t> faces) : mesh_(*mesh), faces_(faces), shape_(*mesh, mesh->P, faces) {
    const size_t corners = size_t(mesh->corners);
    for (const uint32_t f : faces)
      vertices_.insert(vertices_.end(), &mesh->indices[f * corners], &mesh->indices[f * corners] + corners);
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    before_ = picked(mesh->P, vertices_);
  }

  void grow_to(double area) {
    double across = 1;
    if (is_long(shape_)) {
      across = widening(area);
      move(before_, shape_, across, &mesh_.P);
      for (size_t i = 0; !mesh_.N.empty() && i < vertices_.size(); ++i)
        mesh_.N[vertices_[i]] = shape_.widened_normal(before_[i], mesh_.N[vertices_[i]], across);
    }
    const double missing = area / area_now();
    const double all = std::abs(missing - 1) > tolerance ? std::sqrt(missing) : 1;
    scale(all, &mesh_.P);
    if (mesh_.P_end.empty()) return;
    const ComponentShape at_close(mesh_, mesh_.P_end, faces_);
    move(picked(mesh_.P_end, vertices_), at_close, across, &mesh_.P_end);
    scale(all, &mesh_.P_end);
  }

 private:
  static constexpr double tolerance = 1e-3;

  // By how much to scale across. Ends of closed components grow with the square, bends by less: the area at k is
  // interpolated by powers of k between two that enclose it. What would become wider than long, or much wider than it
  // was said to become, grows evenly from there.
  double widening(double area) {
    const double straight = area / shape_.area();
    double low = 1, at_low = shape_.area();
    double high = std::min(1.05 * straight, std::max(shape_.length() / shape_.width(), 1.0)), at_high = area_at(high);
    if (at_high <= area) return high;
    double k = std::min(straight, high);
    for (int i = 0; i < 30; ++i) {
      const double at = area_at(k);
      if (std::abs(at / area - 1) < tolerance / 2) break;
      (at < area ? low : high) = k, (at < area ? at_low : at_high) = at;
      const double x = i % 2 ? 0.5 : std::log(area / at_low) / std::log(at_high / at_low);
      k = low * std::pow(high / low, std::clamp(x, 0.01, 0.99));
    }
    return k;
  }
  double area_at(double k) {
    move(before_, shape_, k, &mesh_.P);
    return area_now();
  }
  double area_now() const {
    const auto corners = size_t(mesh_.corners);
    double twice = 0;
    for (const uint32_t f : faces_) {
      const uint32_t* index = &mesh_.indices[f * corners];
      const V3d a(mesh_.P[index[0]]);
      for (size_t i = 2; i < corners; ++i)
        twice += (V3d(mesh_.P[index[i - 1]]) - a).cross(V3d(mesh_.P[index[i]]) - a).length();
    }
    return twice / 2;
  }
  void move(const std::vector<V3f>& from, const ComponentShape& shape, double k, std::vector<V3f>* P) const {
    for (size_t i = 0; i < vertices_.size(); ++i) (*P)[vertices_[i]] = V3f(shape.widened(from[i], k));
  }
  void scale(double k, std::vector<V3f>* P) const {
    if (k == 1) return;
    const ComponentShape shape(mesh_, *P, faces_);
    for (const uint32_t v : vertices_) (*P)[v] = V3f(shape.scaled((*P)[v], k));
  }

  Mesh& mesh_;
  const std::span<const uint32_t> faces_;
  const ComponentShape shape_;
  std::vector<uint32_t> vertices_;
  std::vector<V3f> before_;
};

}  // namespace

bool prune(Mesh* mesh, const geom::DicingView& view, float pixels, PruningCounts* counts) {
  if (mesh->face_count() < PruningNumbers::least_components) return false;
  const MeshComponents components(*mesh);
  if (components.count() < PruningNumbers::least_components) return false;
  std::vector<Detail> details = details_of(*mesh, components);
  if (details.size() < PruningNumbers::least_components) return false;
  find_pixels(*mesh, components, view, &details);
  std::vector<Fate> fates(components.count());
  Merging(details, pixels, &fates).run();

  std::vector<uint8_t> keep(mesh->face_count());
  size_t kept = 0;
  for (uint32_t c = 0; c < fates.size(); ++c) {
    if (!fates[c].is_kept) continue;
    ++kept;
    for (const uint32_t f : components.faces(c)) keep[f] = 1;
    if (fates[c].area > 0) Growing(mesh, components.faces(c)).grow_to(fates[c].area);
  }
  PruningCounts found{fates.size(), kept, mesh->face_count(), 0, mesh->bytes(), 0};
  if (kept < fates.size()) *mesh = part_of(*mesh, keep);
  found.faces_kept = mesh->face_count(), found.bytes_kept = mesh->bytes();
  *counts += found;
  return kept < fates.size();
}

}  // namespace dapple::vegetation
