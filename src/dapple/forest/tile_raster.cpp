// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/tile_raster.h"

#include <array>

#include "dapple/base/hash.h"

namespace dapple::forest {

namespace {

constexpr int offset_rows = 64;
constexpr float too_far = 1e9f;  // of levels, for integers

/// Where along a row its pixels' samples are: at random by row, so that rows of thin things do not beat with rows of
/// pixels.
const std::array<float, offset_rows>& row_offsets() {
  static const auto table = [] {
    std::array<float, offset_rows> t;
    KeyedRng rng(0x5eed);
    for (float& o : t) o = rng.next();
    return t;
  }();
  return table;
}

}  // namespace

struct TileRaster::Source {
  const FacetClusters& of;
  size_t cluster;
  const FacetOpacity& opacity;
};

SlabTile TileRaster::make(const FacetScene& scene, const MaskFrame& frame, const MaskColumn& column,
                          const ColumnInterest* interest) {
  const int size = column.size;
  x0_ = column.x0, y0_ = column.y0, size_ = size, interest_ = interest;
  offsets_.resize(size_t(size));
  for (int row = 0; row < size; ++row) offsets_[size_t(row)] = row_offsets()[size_t((y0_ + row) & (offset_rows - 1))];
  steepest_ = MaskFrame::steepest * frame.pitch / frame.slab;
  coloured_ = scene.coloured();
  spans_.clear();
  scene.visit(frame, x0_, y0_, size, interest, batch_,
              [&](const FacetBatch& batch, const FacetClusters& of, size_t cluster) {
                const Source from{of, cluster, scene.opacity()};
                add_cluster(batch, from);
                if (asked_ > 0) ask(from);
              });
  if (spans_.empty()) return SlabTile(size, column.top, 0, -1, 1);
  int first = std::numeric_limits<int>::max(), last = column.top;
  for (const Span& s : spans_) first = std::min(first, s.first), last = std::max(last, s.last);
  SlabTile tile(size, column.top, first - column.top, last - column.top, coloured_ ? 3 : 1);
  for (const Span& s : spans_)
    for (int c = 0; c < tile.channels; ++c)
      if (s.channels >> c & 1) tile.fill(c, s.x, s.y, s.first - column.top, s.last - column.top);
  return tile;
}

void TileRaster::add_cluster(const FacetBatch& b, const Source& from) {
  for (int i = 0; i < b.count; ++i) {
    const int lane = b.lane[i];
    for (int row = b.first_row[lane]; row < b.end_row[lane]; ++row) {
      const int k = crossing_count_;
      crossing_lane_[k] = lane;
      crossing_row_[k] = row;
      for (int v = 0; v < 3; ++v) corner_x_[v][k] = b.x[v][lane], corner_y_[v][k] = b.y[v][lane];
      offset_[k] = offsets_[size_t(row)];
      if (++crossing_count_ == rows_at_once) cross_rows(b, from);
    }
  }
  cross_rows(b, from);
}

// Where rows' middles enter and leave facets. Both facets at an edge compute the same crossing, and rows and spans are
// half-open, so that each sample belongs to one of them.
void TileRaster::cross_rows(const FacetBatch& b, const Source& from) {
  const int n = crossing_count_;
  for (int k = 0; k < n; ++k) {
    const float y = float(crossing_row_[k]) + 0.5f;
    const float x0 = corner_x_[0][k], x1 = corner_x_[1][k], x2 = corner_x_[2][k], y0 = corner_y_[0][k],
                y1 = corner_y_[1][k], y2 = corner_y_[2][k];
    float least = infinity, most = -infinity;
    const auto cross = [&](float xa, float ya, float xb, float yb) {
      const bool up = ya < yb;
      const float x_lo = up ? xa : xb, y_lo = up ? ya : yb, x_hi = up ? xb : xa, y_hi = up ? yb : ya;
      const float x = x_lo + (y - y_lo) * ((x_hi - x_lo) / (y_hi - y_lo));
      const bool crosses = bool(int(y_lo <= y) & int(y < y_hi));
      const float low = crosses ? x : infinity, high = crosses ? x : -infinity;
      least = least < low ? least : low;
      most = most > high ? most : high;
    };
    cross(x0, y0, x1, y1);
    cross(x1, y1, x2, y2);
    cross(x2, y2, x0, y0);
    least_[k] = std::ceil(least - offset_[k]);
    most_[k] = std::ceil(most - offset_[k]);
  }
  const float limit = float(size_);
  for (int k = 0; k < n; ++k) {
    const float first = least_[k] > 0 ? least_[k] : 0, end = most_[k] < limit ? most_[k] : limit;
    if (first < end) add_row(b, crossing_lane_[k], crossing_row_[k], int(first), int(end), from);
  }
  crossing_count_ = 0;
}

// Samples [first, end) of a row are on the facet.
void TileRaster::add_row(const FacetBatch& b, int lane, int row, int first, int end, const Source& from) {
  const float xa = b.x[0][lane], ya = b.y[0][lane], za = b.z[0][lane];
  const float xb = b.x[1][lane] - xa, yb = b.y[1][lane] - ya, zb = b.z[1][lane] - za, xc = b.x[2][lane] - xa,
              yc = b.y[2][lane] - ya, zc = b.z[2][lane] - za;
  const float inverse = 1 / (xb * yc - xc * yb);
  float zx = (zb * yc - zc * yb) * inverse, zy = (zc * xb - zb * xc) * inverse;
  const float slope = std::abs(zx) + std::abs(zy);
  const float offset = offsets_[size_t(row)], y = float(row) + 0.5f - ya;
  // Over the whole pixel, so that neighbours share a level at their border. Where it is too steep for that, around the
  // sample.
  const bool steep = !(slope <= steepest_);
  const float reach = (steep ? steepest_ : slope) * 0.5f + 1e-3f, at = steep ? offset - xa : 0.5f - xa;
  const float z_least = za + std::min({0.0f, zb, zc}), z_most = za + std::max({0.0f, zb, zc});
  if (!(z_least > -too_far && z_most < too_far)) return;
  if (!std::isfinite(slope)) zx = zy = 0;
  const bool certain = !from.of.cut_out && from.of.transmittance.is_black();
  for (int i = first; i < end; ++i) {
    float z = za + zx * (float(i) + at) + zy * y;
    if (steep) z = std::clamp(z, z_least, z_most);
    const float top = z - reach;
    if (interest_) {
      // What is below all who look at a square of pixels.
      const float deepest = interest_->deepest_at(i, row);
      if (!(top < deepest)) {
        if (top - std::abs(zx) * ColumnInterest::side >= deepest) i |= ColumnInterest::side - 1;
        continue;
      }
    }
    const Span span{uint16_t(i), uint16_t(row), int32_t(std::floor(top)), int32_t(std::floor(z + reach)), 7};
    certain ? spans_.push_back(span) : found(span, lane, float(i) + offset, float(row) + 0.5f, b, from);
  }
}

// A facet that light may pass, at a sample.
void TileRaster::found(const Span& span, int lane, float x, float y, const FacetBatch& b, const Source& from) {
  const uint32_t primitive = from.of.strips.empty() ? from.of.clusters[from.cluster].primitive[lane] : uint32_t(lane);
  // The pixel counts by its place in the whole grid, so that tiles agree where they overlap.
  const uint64_t key = hash(x0_ + span.x, y0_ + span.y, from.of.geometry, primitive, from.cluster, span.first);
  if (!from.of.cut_out) return keep(span, key, RGB(1) - from.of.transmittance);
  const float xa = x - b.x[0][lane], ya = y - b.y[0][lane], xb = b.x[1][lane] - b.x[0][lane],
              yb = b.y[1][lane] - b.y[0][lane], xc = b.x[2][lane] - b.x[0][lane], yc = b.y[2][lane] - b.y[0][lane],
              inverse = 1 / (xb * yc - xc * yb);
  const float b1 = (xa * yc - xc * ya) * inverse, b2 = (xb * ya - xa * yb) * inverse, b0 = 1 - b1 - b2;
  const FacetClusters::Uv& uv = from.of.uv[from.cluster];
  const auto mixed = [&](const auto& at) {
    return std::clamp(b0 * at[0][lane] + b1 * at[1][lane] + b2 * at[2][lane], 0.0f, 1.0f);
  };
  questions_[asked_++] = {span, key, primitive, mixed(uv.u), mixed(uv.v)};
  if (asked_ == asked_at_once) ask(from);
}

void TileRaster::keep(Span span, uint64_t key, const RGB& opacity) {
  const float random = to_unit_float(key);
  span.channels = uint8_t((random < opacity.r) | (random < opacity.g) << 1 | (random < opacity.b) << 2);
  if (span.channels) spans_.push_back(span);
}

void TileRaster::ask(const Source& from) {
  uint32_t primitive[asked_at_once];
  float u[asked_at_once], v[asked_at_once], alpha[asked_at_once];
  for (int i = 0; i < asked_; ++i)
    primitive[i] = questions_[i].primitive, u[i] = questions_[i].u, v[i] = questions_[i].v;
  std::fill_n(alpha, asked_, 1.0f);
  if (from.opacity) from.opacity(from.of.geometry, asked_, primitive, u, v, alpha);
  for (int i = 0; i < asked_; ++i)
    keep(questions_[i].span, questions_[i].key, (RGB(1) - from.of.transmittance) * alpha[i]);
  asked_ = 0;
}

}  // namespace dapple::forest
