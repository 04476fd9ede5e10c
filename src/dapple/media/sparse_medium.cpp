// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/sparse_medium.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace dapple::media {
namespace {

constexpr int most_cells = 64;      // along an axis
constexpr double least_voxels = 4;  // along the edge of a cell

V3d size_of(const SparseGrid::Extent& e) {
  return V3d(e.hi) - V3d(e.lo);
}

Transform cube_to_index(const SparseGrid::Extent& e) {
  return Transform::translate(V3d(e.lo)) * Transform::scale(size_of(e));
}

/// Raises cells of majorants to the values that look-ups in them may read.
class CellBounds {
 public:
  CellBounds(MajorantGrid* cells, const SparseGrid::Extent& extent) : cells_(*cells), lo_(extent.lo) {
    const V3d size = size_of(extent);
    const std::array<int, 3> n = {cells_.nx, cells_.ny, cells_.nz};
    for (int k = 0; k < 3; ++k) per_voxel_[k] = n[k] / size[k], count_[k] = n[k];
  }

  /// Lattice points of one value, from `at` with `edge` of them along each axis.
  void add(const V3i& at, int edge, float value) {
    std::array<Range, 3> r;
    for (int k = 0; k < 3; ++k) {
      r[k] = cells(k, at[k], double(at[k]) + edge - 1);
      if (r[k].first > r[k].last) return;
    }
    raise(r[0], r[1], r[2], value);
  }
  void add_block(const V3i& at, const float* values) {
    std::array<std::array<Range, 8>, 3> r;
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 8; ++i) r[k][i] = cells(k, at[k] + i, double(at[k]) + i);
    for (int i = 0; i < 512; ++i)
      if (values[i] > 0) raise(r[0][i >> 6], r[1][(i >> 3) & 7], r[2][i & 7], values[i]);
  }

 private:
  struct Range {
    int first, last;
  };
  /// Of axis k, cells with points less than one from the lattice points, and a little wider, for positions that round
  /// across the border.
  Range cells(int k, double first, double last) const {
    const auto cell = [&](double at) {
      return std::floor(std::clamp((at - lo_[k]) * per_voxel_[k], -2.0, count_[k] + 1.0));
    };
    constexpr double slack = 1e-3;
    return {std::max(int(cell(first - 1 - slack)), 0), std::min(int(cell(last + 1 + slack)), count_[k] - 1)};
  }
  void raise(const Range& x, const Range& y, const Range& z, float value) {
    for (int k = z.first; k <= z.last; ++k)
      for (int j = y.first; j <= y.last; ++j)
        for (int i = x.first; i <= x.last; ++i) {
          float& v = cells_.values[(size_t(k) * cells_.ny + j) * cells_.nx + i];
          v = std::max(v, value);
        }
  }

  MajorantGrid& cells_;
  const V3d lo_;
  std::array<double, 3> per_voxel_;
  std::array<int, 3> count_;
};

}  // namespace

SparseMedium::IndexMap::IndexMap(const Transform& t)
    : x(t.vector(V3f(1, 0, 0))), y(t.vector(V3f(0, 1, 0))), z(t.vector(V3f(0, 0, 1))), origin(t.point(V3f(0, 0, 0))) {}

SparseMedium::SparseMedium(Content content, const Transform& medium_to_world, HenyeyGreenstein phase, std::string name)
    : UnevenMedium(phase),
      content_(std::move(content)),
      cube_to_world_(medium_to_world * content_.density.index_to_world() * cube_to_index(content_.density.active())),
      world_to_cube_(cube_to_world_.inverse()),
      density_index_(cube_to_index(content_.density.active())),
      temperature_index_(content_.temperature
                             ? content_.temperature->index_to_world().inverse() * content_.density.index_to_world() *
                                   cube_to_index(content_.density.active())
                             : Transform()),
      name_(std::move(name)) {
  build_majorants();
  if (!content_.temperature || !(content_.emission_scale > 0) || content_.sigma_a.is_black()) return;
  const float most = content_.temperature->max(), offset = content_.temperature_offset;
  BlackbodyTable table((most - offset) * content_.temperature_scale);
  if (!table.is_black()) glow_ = std::move(table);
}

void SparseMedium::build_majorants() {
  const SparseGrid& density = content_.density;
  const V3d size = size_of(density.active());
  const auto cells = [](double voxels) {
    return int(std::clamp(std::ceil(voxels / least_voxels), 1.0, double(most_cells)));
  };
  majorants_.nx = cells(size.x), majorants_.ny = cells(size.y), majorants_.nz = cells(size.z);
  majorants_.values.assign(size_t(majorants_.nx) * majorants_.ny * majorants_.nz, density.background());
  CellBounds bounds(&majorants_, density.active());
  density.visit([&](const V3i& at, const float* values) { bounds.add_block(at, values); },
                [&](const V3i& at, int edge, float value) { bounds.add(at, edge, value); });
  const float sigma_t = (content_.sigma_a + content_.sigma_s).max();
  for (float& v : majorants_.values) v *= sigma_t * (1 + 1e-5f);  // above what interpolation rounds up to
}

float SparseMedium::most_extinction() const {
  return *std::max_element(majorants_.values.begin(), majorants_.values.end());
}

MajorantWalk SparseMedium::walk(const Ray& ray, float t_max) const {
  return {majorants_, world_to_cube_.point(ray.o), world_to_cube_.vector(ray.d), t_max};
}

void SparseMedium::coefficients(const V3f* P, float, int n, MediumPoint* out) const {
  for (int i = 0; i < n; ++i) {
    const V3f p = world_to_cube_.point(P[i]);
    out[i] = {};
    if (!is_in_cube(p)) continue;
    const float density = content_.density.lookup(density_index_(p));
    out[i] = {content_.sigma_a * density, content_.sigma_s * density, glow_ ? emission(p) : RGB(0)};
  }
}

Box3f SparseMedium::bounds() const {
  return bounds_of_cube(cube_to_world_);
}

std::optional<RGB> SparseMedium::extinction_color() const {
  return color_of(content_.sigma_a + content_.sigma_s);
}

int SparseMedium::stretches(const Ray& ray, float t_max, Stretch* out) const {
  return UnevenMedium::stretches(walk(ray, t_max), out);
}

RGB SparseMedium::emission(const V3f& p) const {
  const float temperature = content_.temperature->lookup(temperature_index_(p));
  return (*glow_)((temperature - content_.temperature_offset) * content_.temperature_scale) * content_.emission_scale;
}

MediumSample SparseMedium::sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MajorantWalk along = walk(ray, t_max);
  const MediumSample out = fly(&along, t_max, beta, key, [this](const V3f& p) {
    const float density = content_.density.lookup(density_index_(p));
    return MediumPoint{content_.sigma_a * density, content_.sigma_s * density, glow_ ? emission(p) : RGB(0)};
  });
  given_up_.add(along);
  return out;
}

RGB SparseMedium::transmittance(const Ray& ray, float t_max, uint64_t key) const {
  MajorantWalk along = walk(ray, t_max);
  const RGB sigma_t = content_.sigma_a + content_.sigma_s;
  const RGB out = track_transmittance(
      &along, key, [&](const V3f& p) { return sigma_t * content_.density.lookup(density_index_(p)); });
  given_up_.add(along);
  return out;
}

}  // namespace dapple::media
