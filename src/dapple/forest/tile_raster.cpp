// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/tile_raster.h"

#include <array>

#include "dapple/base/hash.h"

namespace dapple::forest {

namespace {

constexpr int jitter_side = 32;
constexpr float too_far = 1e9f;  // of levels, for integers

struct Offset {
  float x, y;
};

/// Where in a pixel its sample is: at random, so that rows of thin things do not beat with rows of pixels.
const std::array<Offset, jitter_side * jitter_side>& jitter() {
  static const auto table = [] {
    std::array<Offset, jitter_side * jitter_side> t;
    KeyedRng rng(0x5eed);
    for (Offset& o : t) {
      o.x = rng.next();
      o.y = rng.next();
    }
    return t;
  }();
  return table;
}

/// One side of an edge. Both facets at an edge compute the same number, so that each point is on exactly one side of it.
struct Edge {
  float a, b, c;
  bool inside_is_positive;

  Edge(float x0, float y0, float x1, float y1, bool counter_clockwise) {
    const bool swapped = x1 < x0 || (x1 == x0 && y1 < y0);
    if (swapped) std::swap(x0, x1), std::swap(y0, y1);
    a = y0 - y1, b = x1 - x0;
    c = -(a * x0 + b * y0);
    inside_is_positive = swapped != counter_clockwise;
  }
  bool inside(float x, float y) const { return (a * x + b * y + c >= 0) == inside_is_positive; }
};

}  // namespace

struct TileRaster::Source {
  const FacetClusters& of;
  size_t cluster;
  const FacetOpacity& opacity;
};

SlabTile TileRaster::make(const FacetScene& scene, const MaskFrame& frame, int64_t x0, int64_t y0, int size) {
  x0_ = x0, y0_ = y0, size_ = size;
  steepest_ = MaskFrame::steepest * frame.pitch / frame.slab;
  coloured_ = scene.coloured();
  spans_.clear();
  scene.visit(frame, x0, y0, size, batch_, [&](const FacetBatch& batch, const FacetClusters& of, size_t cluster) {
    const Source from{of, cluster, scene.opacity()};
    for (int i = 0; i < batch.count; ++i) add_facet(batch, i, from);
    if (asked_ > 0) ask(from);
  });
  if (spans_.empty()) return SlabTile(size, 0, 0, 1);
  int first = std::numeric_limits<int>::max(), last = std::numeric_limits<int>::min();
  for (const Span& s : spans_) first = std::min(first, s.first), last = std::max(last, s.last);
  SlabTile tile(size, first, last - first + 1, coloured_ ? 3 : 1);
  for (const Span& s : spans_)
    for (int c = 0; c < tile.channels; ++c)
      if (s.channels >> c & 1) tile.fill(c, s.x, s.y, s.first - first, s.last - first);
  return tile;
}

void TileRaster::add_facet(const FacetBatch& b, int i, const Source& from) {
  const float xa = b.x[0][i], ya = b.y[0][i], xb = b.x[1][i], yb = b.y[1][i], xc = b.x[2][i], yc = b.y[2][i];
  const float doubled_area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya);
  const float limit = float(size_ - 1);
  const int i0 = int(std::clamp(std::min({xa, xb, xc}), 0.0f, limit)), i1 = int(std::clamp(std::max({xa, xb, xc}), 0.0f, limit));
  const int j0 = int(std::clamp(std::min({ya, yb, yc}), 0.0f, limit)), j1 = int(std::clamp(std::max({ya, yb, yc}), 0.0f, limit));
  if (!(std::abs(doubled_area) > 0)) return;

  const bool turns_left = doubled_area > 0;
  const Edge edges[3] = {{xa, ya, xb, yb, turns_left}, {xb, yb, xc, yc, turns_left}, {xc, yc, xa, ya, turns_left}};
  const float za = b.z[0][i], zb = b.z[1][i], zc = b.z[2][i], inverse = 1 / doubled_area;
  const float zx = ((zb - za) * (yc - ya) - (zc - za) * (yb - ya)) * inverse, zy = ((zc - za) * (xb - xa) - (zb - za) * (xc - xa)) * inverse;
  const float z_least = std::min({za, zb, zc}), z_most = std::max({za, zb, zc});
  if (!(z_least > -too_far && z_most < too_far)) return;
  const float slope = std::abs(zx) + std::abs(zy);
  const bool steep = !(slope <= steepest_);
  const float reach = (steep ? steepest_ : slope) * 0.5f + 1e-3f;
  const auto& offsets = jitter();
  const bool cut_out = from.of.cut_out;
  const uint32_t primitive = from.of.strips.empty() ? from.of.clusters[from.cluster].primitive[b.lane[i]] : b.lane[i];

  for (int y = j0; y <= j1; ++y) {
    const Offset* const row = &offsets[size_t(((y0_ + y) & (jitter_side - 1)) * jitter_side)];
    for (int x = i0; x <= i1; ++x) {
      const Offset o = row[(x0_ + x) & (jitter_side - 1)];
      const float sx = float(x) + o.x, sy = float(y) + o.y;
      if (!(edges[0].inside(sx, sy) && edges[1].inside(sx, sy) && edges[2].inside(sx, sy))) continue;
      // Over the whole pixel, so that neighbours share a level at their border. Where it is too steep for that, around the sample.
      const float z = steep ? std::clamp(za + zx * (sx - xa) + zy * (sy - ya), z_least, z_most) : za + zx * (float(x) + 0.5f - xa) + zy * (float(y) + 0.5f - ya);
      const Span span{uint16_t(x), uint16_t(y), int32_t(std::floor(z - reach)), int32_t(std::floor(z + reach)), 7};
      if (!cut_out && from.of.transmittance.is_black()) {
        spans_.push_back(span);
        continue;
      }
      float u = 0, v = 0;
      if (cut_out) {
        const FacetClusters::Uv& uv = from.of.uv[from.cluster];
        const int lane = b.lane[i];
        const float b1 = ((sx - xa) * (yc - ya) - (xc - xa) * (sy - ya)) * inverse, b2 = ((xb - xa) * (sy - ya) - (sx - xa) * (yb - ya)) * inverse, b0 = 1 - b1 - b2;
        u = std::clamp(b0 * uv.u[0][lane] + b1 * uv.u[1][lane] + b2 * uv.u[2][lane], 0.0f, 1.0f);
        v = std::clamp(b0 * uv.v[0][lane] + b1 * uv.v[1][lane] + b2 * uv.v[2][lane], 0.0f, 1.0f);
      }
      found(span, primitive, u, v, from);
    }
  }
}

void TileRaster::found(const Span& span, uint32_t primitive, float u, float v, const Source& from) {
  // The pixel counts by its place in the whole grid, so that tiles agree where they overlap.
  const uint64_t key = hash(x0_ + span.x, y0_ + span.y, from.of.geometry, primitive, from.cluster, span.first);
  if (!from.of.cut_out) return keep(span, key, RGB(1) - from.of.transmittance);
  questions_[asked_++] = {span, key, primitive, u, v};
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
  for (int i = 0; i < asked_; ++i) primitive[i] = questions_[i].primitive, u[i] = questions_[i].u, v[i] = questions_[i].v;
  std::fill_n(alpha, asked_, 1.0f);
  if (from.opacity) from.opacity(from.of.geometry, asked_, primitive, u, v, alpha);
  for (int i = 0; i < asked_; ++i) keep(questions_[i].span, questions_[i].key, (RGB(1) - from.of.transmittance) * alpha[i]);
  asked_ = 0;
}

}  // namespace dapple::forest
