// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/facet_scene.h"

#include "dapple/numeric/morton.h"

namespace dapple::forest {

namespace {

constexpr int capacity = FacetCluster::capacity;

/// Order along Morton's curve of things by their places in a box; equal ones as they are. Keys of 30 bits above numbers
/// of 32. Those without a place are left out.
template <class Place>
std::vector<uint32_t> along_curve(size_t count, const Place& place) {
  Box3f box;
  for (size_t i = 0; i < count; ++i)
    if (const V3f p = place(i); base::is_finite(p)) box.extendBy(p);
  V3f scale;
  for (int k = 0; k < 3; ++k) scale[k] = box.max[k] > box.min[k] ? 1023 / (box.max[k] - box.min[k]) : 0;
  std::vector<uint64_t> keys;
  keys.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const V3f p = place(i);
    if (!base::is_finite(p)) continue;
    uint64_t key = 0;
    for (int k = 0; k < 3; ++k)
      key |= spread_bits_by_3(uint32_t(std::clamp((p[k] - box.min[k]) * scale[k], 0.0f, 1023.0f))) << k;
    keys.push_back(key << 32 | i);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order;
  order.reserve(keys.size());
  for (const uint64_t key : keys) order.push_back(uint32_t(key));
  return order;
}

/// The box of a box under an affine map.
Box3f map_box(const AffineRows& map, const Box3f& box) {
  Box3f out;
  for (int k = 0; k < 3; ++k) {
    float centre = map.m[k][3], reach = 0, sum = std::abs(centre);
    for (int a = 0; a < 3; ++a) {
      const float middle = map.m[k][a] * 0.5f * (box.min[a] + box.max[a]);
      centre += middle, sum += std::abs(middle);
      reach += std::abs(map.m[k][a]) * 0.5f * (box.max[a] - box.min[a]);
    }
    const float slack = 1e-6f * (sum + reach);  // of rounding
    out.min[k] = centre - reach - slack, out.max[k] = centre + reach + slack;
  }
  return out;
}

bool meets(const AffineRows& to_grid, const Box3f& box, float size, const ColumnInterest* interest) {
  const Box3f b = map_box(to_grid, box);
  return b.max.x >= 0 && b.min.x <= size && b.max.y >= 0 && b.min.y <= size && (!interest || interest->wants(b));
}

float lesser(float a, float b) {
  return a < b ? a : b;
}
float greater(float a, float b) {
  return a > b ? a : b;
}

/// Finds the facets that cross the middle of a row in the column. Those between two rows, which are many where facets
/// are small, end here.
void select(int count, float size, FacetBatch& b) {
  alignas(32) int32_t wanted[capacity];
  for (int i = 0; i < capacity; ++i) {
    const float x0 = lesser(lesser(b.x[0][i], b.x[1][i]), b.x[2][i]),
                x1 = greater(greater(b.x[0][i], b.x[1][i]), b.x[2][i]);
    const float y0 = lesser(lesser(b.y[0][i], b.y[1][i]), b.y[2][i]),
                y1 = greater(greater(b.y[0][i], b.y[1][i]), b.y[2][i]);
    const float first = greater(std::ceil(y0 - 0.5f), 0.0f), end = lesser(std::ceil(y1 - 0.5f), size);
    b.first_row[i] = int32_t(lesser(first, size)), b.end_row[i] = int32_t(greater(end, 0.0f));
    wanted[i] = int32_t(first < end) & int32_t(x1 >= 0) & int32_t(x0 <= size);
  }
  b.count = 0;
  for (int i = 0; i < count; ++i) {
    b.lane[b.count] = uint8_t(i);
    b.count += wanted[i];
  }
}

/// Moves a cluster to the grid.
void gather(const FacetCluster& c, const AffineRows& to_grid, FacetBatch& b) {
  const auto& m = to_grid.m;
  for (int v = 0; v < 3; ++v)
    for (int i = 0; i < capacity; ++i) {
      const float x = c.x[v][i], y = c.y[v][i], z = c.z[v][i];
      b.x[v][i] = m[0][0] * x + m[0][1] * y + m[0][2] * z + m[0][3];
      b.y[v][i] = m[1][0] * x + m[1][1] * y + m[1][2] * z + m[1][3];
      b.z[v][i] = m[2][0] * x + m[2][1] * y + m[2][2] * z + m[2][3];
    }
}

/// Ribbons of strips [first, first + count) / 2 that face the light, in the grid; two facets each.
void gather_strips(const FacetClusters& of, size_t cluster, const AffineRows& to_grid, FacetBatch& b) {
  const auto& m = to_grid.m;
  const float pixels = std::sqrt(m[0][0] * m[0][0] + m[0][1] * m[0][1] + m[0][2] * m[0][2]);
  for (int s = 0; s < of.clusters[cluster].count / 2; ++s) {
    const FacetStrip& strip = of.strips[cluster * (capacity / 2) + size_t(s)];
    const V3f p = to_grid.point(strip.p[0]), q = to_grid.point(strip.p[1]);
    V2f side(p.y - q.y, q.x - p.x);
    const float l = side.length();
    side = l > 0 ? side / l : V2f(1, 0);
    const V2f a = side * (strip.radius[0] * pixels), c = side * (strip.radius[1] * pixels);
    const V3f corner[4] = {{p.x - a.x, p.y - a.y, p.z},
                           {p.x + a.x, p.y + a.y, p.z},
                           {q.x + c.x, q.y + c.y, q.z},
                           {q.x - c.x, q.y - c.y, q.z}};
    const int corners[2][3] = {{0, 1, 2}, {2, 3, 0}};
    for (int t = 0; t < 2; ++t)
      for (int v = 0; v < 3; ++v) {
        const V3f& at = corner[corners[t][v]];
        b.x[v][2 * s + t] = at.x, b.y[v][2 * s + t] = at.y, b.z[v][2 * s + t] = at.z;
      }
  }
}

}  // namespace

V3f AffineRows::point(const V3f& p) const {
  V3f out;
  for (int k = 0; k < 3; ++k) out[k] = m[k][0] * p.x + m[k][1] * p.y + m[k][2] * p.z + m[k][3];
  return out;
}

AffineRows AffineRows::after(const AffineRows& first) const {
  AffineRows out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      double sum = j == 3 ? double(m[i][3]) : 0;
      for (int k = 0; k < 3; ++k) sum += double(m[i][k]) * double(first.m[k][j]);
      out.m[i][j] = float(sum);
    }
  return out;
}

FacetClusters::FacetClusters(const std::vector<Facet>& facets, const std::vector<FacetUv>& corners, const RGB& passed)
    : transmittance(passed) {
  const std::vector<uint32_t> order = along_curve(
      facets.size(), [&](size_t i) { return (facets[i].p[0] + facets[i].p[1] + facets[i].p[2]) * (1.0f / 3); });
  clusters.resize((order.size() + capacity - 1) / capacity);
  if (!corners.empty()) uv.resize(clusters.size());
  for (size_t c = 0; c < clusters.size(); ++c) {
    FacetCluster& to = clusters[c];
    to.count = int(std::min(size_t(capacity), order.size() - c * capacity));
    for (int i = 0; i < capacity; ++i) {
      const uint32_t from =
          order[c * capacity + size_t(std::min(i, to.count - 1))];  // what is left is filled, for whole vectors
      const Facet& f = facets[from];
      to.primitive[i] = f.primitive;
      for (int v = 0; v < 3; ++v) {
        to.x[v][i] = f.p[v].x, to.y[v][i] = f.p[v].y, to.z[v][i] = f.p[v].z;
        to.box.extendBy(f.p[v]);
        if (!corners.empty()) uv[c].u[v][i] = corners[from].u[v], uv[c].v[v][i] = corners[from].v[v];
      }
    }
    if (c % group == 0) group_boxes.emplace_back();
    group_boxes.back().extendBy(to.box);
    box.extendBy(to.box);
  }
}

FacetClusters::FacetClusters(const std::vector<FacetStrip>& all) {
  const auto place = [&](size_t i) {
    return all[i].radius[0] >= 0 && all[i].radius[1] >= 0 ? (all[i].p[0] + all[i].p[1]) * 0.5f : V3f(infinity);
  };
  for (const uint32_t i : along_curve(all.size(), place)) strips.push_back(all[i]);
  constexpr size_t held = capacity / 2;
  clusters.resize((strips.size() + held - 1) / held);
  for (size_t c = 0; c < clusters.size(); ++c) {
    const size_t count = std::min(held, strips.size() - c * held);
    clusters[c].count = int(2 * count);
    for (size_t i = c * held; i < c * held + count; ++i)
      for (int e = 0; e < 2; ++e) {
        const V3f r(strips[i].radius[e]);
        clusters[c].box.extendBy(strips[i].p[e] - r);
        clusters[c].box.extendBy(strips[i].p[e] + r);
      }
    if (c % group == 0) group_boxes.emplace_back();
    group_boxes.back().extendBy(clusters[c].box);
    box.extendBy(clusters[c].box);
  }
}

size_t FacetClusters::bytes() const {
  return clusters.size() * sizeof(FacetCluster) + uv.size() * sizeof(Uv) + group_boxes.size() * sizeof(Box3f) +
         strips.size() * sizeof(FacetStrip);
}

uint32_t FacetScene::add(std::shared_ptr<const FacetClusters> clusters) {
  const RGB& t = clusters->transmittance;
  coloured_ |= t.r != t.g || t.g != t.b;
  clusters_.push_back(std::move(clusters));
  return uint32_t(clusters_.size() - 1);
}

void FacetScene::place(uint32_t clusters, const AffineRows& world) {
  if (clusters_[clusters]->clusters.empty()) return;
  placements_.push_back({clusters, world});
  bounds_.extendBy(map_box(world, clusters_[clusters]->box));
}

size_t FacetScene::bytes() const {
  size_t sum = placements_.size() * sizeof(Placement);
  for (const auto& c : clusters_) sum += c->bytes();
  return sum;
}

void ColumnInterest::reset(int pixels) {
  squares = (pixels + side - 1) / side;
  deepest.assign(size_t(squares) * size_t(squares), -infinity);
}

void ColumnInterest::add(float x, float y, float reach, float level) {
  const auto index = [&](float v) { return std::clamp(int(v) / side, 0, squares - 1); };
  const int i0 = index(x - reach), i1 = index(x + reach), j0 = index(y - reach), j1 = index(y + reach);
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i) {
      float& d = deepest[size_t(j) * size_t(squares) + size_t(i)];
      d = std::max(d, level);
    }
}

bool ColumnInterest::wants(const Box3f& box) const {
  const auto index = [&](float v) { return std::clamp(int(std::clamp(v, -1e6f, 1e6f)) / side, 0, squares - 1); };
  const int i0 = index(box.min.x), i1 = index(box.max.x), j0 = index(box.min.y), j1 = index(box.max.y);
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i)
      if (deepest[size_t(j) * size_t(squares) + size_t(i)] > box.min.z) return true;
  return false;
}

void FacetScene::visit(const MaskFrame& frame, int64_t x0, int64_t y0, int size, const ColumnInterest* interest,
                       FacetBatch& batch, const Visit& visit) const {
  AffineRows grid;
  for (int a = 0; a < 3; ++a) {
    grid.m[0][a] = frame.x[a] / frame.pitch;
    grid.m[1][a] = frame.y[a] / frame.pitch;
    grid.m[2][a] = -frame.to_light[a] / frame.slab;
  }
  grid.m[0][3] = -float(x0), grid.m[1][3] = -float(y0);
  const float reach = float(size);
  for (const Placement& p : placements_) {
    const FacetClusters& of = *clusters_[p.clusters];
    const AffineRows to_grid = grid.after(p.world);
    if (!meets(to_grid, of.box, reach, interest)) continue;
    for (size_t g = 0; g < of.group_boxes.size(); ++g) {
      if (!meets(to_grid, of.group_boxes[g], reach, interest)) continue;
      const size_t end = std::min((g + 1) * FacetClusters::group, of.clusters.size());
      for (size_t c = g * FacetClusters::group; c < end; ++c) {
        if (!meets(to_grid, of.clusters[c].box, reach, interest)) continue;
        of.strips.empty() ? gather(of.clusters[c], to_grid, batch) : gather_strips(of, c, to_grid, batch);
        select(of.clusters[c].count, reach, batch);
        if (batch.count > 0) visit(batch, of, c);
      }
    }
  }
}

}  // namespace dapple::forest
