// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/image_builder.h"

#include <algorithm>

#include "dapple/base/error.h"
#include "dapple/depthimage/image_numbers.h"

namespace dapple::depthimage {

namespace {

constexpr int side = SampleMask::side;
constexpr std::ptrdiff_t looked_back = 64;  // groups, of which those before are too far above

/// Samples [first, end) of a row that the middle of the row has of a triangle. Both facets at an edge compute the same
/// crossing.
struct RowSpan {
  int first = 0, end = 0;
};

RowSpan cross_row(const V3f p[3], int row, int size) {
  const float y = float(row) + 0.5f;
  float least = infinity, most = -infinity;
  for (int e = 0; e < 3; ++e) {
    const V3f &a = p[e], &b = p[(e + 1) % 3];
    const V3f &low = a.y < b.y ? a : b, &high = a.y < b.y ? b : a;
    if (!(low.y <= y && y < high.y)) continue;
    const float x = low.x + (y - low.y) * ((high.x - low.x) / (high.y - low.y));
    least = std::min(least, x);
    most = std::max(most, x);
  }
  if (!(least <= most)) return {};
  const auto column = [size](float x) { return int(std::clamp(std::ceil(x - 0.5f), 0.0f, float(size))); };
  return {column(least), column(most)};
}

unsigned span_bits(const RowSpan& span, int first_column) {
  const int a = std::clamp(span.first - first_column, 0, side), b = std::clamp(span.end - first_column, 0, side);
  return a < b ? ((1u << (b - a)) - 1) << a : 0;
}

/// Pieces of a texel that become one fragment.
struct Group {
  unsigned mask = 0;
  float heights = 0;  // sum over samples
  V3f normals{0, 0, 0}, first_normal{0, 0, 0};
  ImageBuilder::Piece first{};
  uint8_t material = 0;
  ImageBuilder::Piece largest{};

  int samples() const { return std::popcount(mask); }
  float height() const { return heights / float(samples()); }
  void add(const ImageBuilder::Piece& piece, const V3f& n) {
    const float count = float(std::popcount(unsigned(piece.mask)));
    if (mask == 0) first_normal = n, first = piece;
    if (std::popcount(unsigned(piece.mask)) > std::popcount(unsigned(largest.mask))) largest = piece;
    mask |= piece.mask;
    heights += piece.height * count;
    normals += face_forward(n, first_normal) * count;
  }
};

// What is seen from the front within so many layers of each sample; groups go front to back.
void limit_layers(int layers, std::vector<Group>* groups) {
  int seen[SampleMask::count] = {};
  for (Group& g : *groups) {
    unsigned kept = 0;
    for (int s = 0; s < SampleMask::count; ++s)
      if (g.mask >> s & 1 && seen[s]++ < layers) kept |= 1u << s;
    g.heights = g.samples() > 0 ? g.height() * float(std::popcount(kept)) : 0;
    g.mask = kept;
  }
  std::erase_if(*groups, [](const Group& g) { return g.mask == 0; });
}

}  // namespace

ImageBuilder::ImageBuilder(const ViewFrame& frame, const V3f& centre, float radius, int resolution)
    : frame_(frame),
      centre_(centre),
      radius_(radius),
      texel_(2 * radius / float(resolution)),
      resolution_(resolution) {}

V3f ImageBuilder::to_samples(const V3f& p) const {
  const V3f q = p - centre_;
  const float scale = float(side) / texel_;
  return {(dot(q, frame_.u) + radius_) * scale, (dot(q, frame_.v) + radius_) * scale, dot(q, frame_.w)};
}

void ImageBuilder::add(uint32_t facet, const V3f corners[3]) {
  V3f p[3];
  for (int c = 0; c < 3; ++c) p[c] = to_samples(corners[c]);
  const int size = resolution_ * side;
  const float y0 = std::min({p[0].y, p[1].y, p[2].y}), y1 = std::max({p[0].y, p[1].y, p[2].y});
  if (!(y1 >= y0)) return;  // no numbers
  const int first_row = int(std::clamp(std::ceil(y0 - 0.5f), 0.0f, float(size))),
            end_row = int(std::clamp(std::ceil(y1 - 0.5f), 0.0f, float(size)));
  if (first_row >= end_row) return;
  const V3f a = p[1] - p[0], b = p[2] - p[0];
  const float area = a.x * b.y - b.x * a.y;
  const float zx = (a.z * b.y - b.z * a.y) / area, zy = (b.z * a.x - a.z * b.x) / area;
  const bool flat = std::isfinite(zx) && std::isfinite(zy);
  const float z0 = std::min({p[0].z, p[1].z, p[2].z}), z1 = std::max({p[0].z, p[1].z, p[2].z});
  for (int row = first_row / side; row * side < end_row; ++row) {
    RowSpan spans[side];
    int first = size, end = 0;
    for (int k = 0; k < side; ++k) {
      const int y = row * side + k;
      if (y < first_row || y >= end_row) continue;
      spans[k] = cross_row(p, y, size);
      if (spans[k].first >= spans[k].end) continue;
      first = std::min(first, spans[k].first), end = std::max(end, spans[k].end);
    }
    for (int column = first / side; column * side < end; ++column) {
      unsigned mask = 0;
      for (int k = 0; k < side; ++k) mask |= span_bits(spans[k], column * side) << (k * side);
      if (!mask) continue;
      if (pieces_.size() >= most_pieces) throw MemoryError("images of an object: more pieces of surfaces than fit");
      Piece piece{uint32_t(row * resolution_ + column), facet, p[0].z, uint16_t(mask)};
      const V2f at = place_of(piece) * float(side);
      if (flat) piece.height = std::clamp(p[0].z + (at.x - p[0].x) * zx + (at.y - p[0].y) * zy, z0, z1);
      pieces_.push_back(piece);
    }
  }
}

V3f ImageBuilder::weights(const V3f corners[3], const V2f& place) const {
  V3f p[3];
  for (int c = 0; c < 3; ++c) p[c] = to_samples(corners[c]);
  const V2f at = place * float(side), a(p[1].x - p[0].x, p[1].y - p[0].y), b(p[2].x - p[0].x, p[2].y - p[0].y),
            q(at.x - p[0].x, at.y - p[0].y);
  const float area = a.x * b.y - b.x * a.y;
  float w1 = (q.x * b.y - b.x * q.y) / area, w2 = (a.x * q.y - q.x * a.y) / area;
  if (!std::isfinite(w1) || !std::isfinite(w2)) w1 = w2 = 1.0f / 3;
  w1 = std::clamp(w1, 0.0f, 1.0f);
  w2 = std::clamp(w2, 0.0f, 1 - w1);
  return {1 - w1 - w2, w1, w2};
}

// Whether the way from one piece to another of the same texel stays on the first one's surface, which may be bent.
bool ImageBuilder::continues(const Piece& from, const V3f& n, const Piece& to) const {
  const V2f across = (SampleMask::centroid(to.mask) - SampleMask::centroid(from.mask)) * texel_;
  const V3f way = frame_.u * across.x + frame_.v * across.y + frame_.w * (to.height - from.height);
  return std::abs(to.height - from.height) <= ImageNumbers::merge_depth * texel_ &&
         std::abs(dot(n, way)) <= ImageNumbers::merge_sine * length(way);
}

void ImageBuilder::keep_samples(unsigned mask, const V3f& n, Piece* piece) const {
  const V2f before = SampleMask::centroid(piece->mask);
  piece->mask = uint16_t(piece->mask & mask);
  if (piece->mask == 0) return;
  const V2f way = (SampleMask::centroid(piece->mask) - before) * texel_;
  const float change = -(dot(n, frame_.u) * way.x + dot(n, frame_.v) * way.y) / dot(n, frame_.w);
  if (std::isfinite(change)) piece->height += std::clamp(change, -texel_, texel_);
}

ImageBuilder::Folded ImageBuilder::fold(int layers, const std::function<V3f(uint32_t)>& normal,
                                        const std::function<uint8_t(uint32_t)>& material) {
  std::erase_if(pieces_, [](const Piece& p) { return p.mask == 0; });
  std::stable_sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
    return a.texel != b.texel ? a.texel < b.texel : a.height > b.height;
  });
  Folded out;
  out.image.first.assign(size_t(resolution_) * size_t(resolution_) + 1, 0);
  std::vector<Group> groups;
  uint32_t next_texel = 0;
  for (size_t begin = 0, end = 0; begin < pieces_.size(); begin = end) {
    const uint32_t texel = pieces_[begin].texel;
    groups.clear();
    for (end = begin; end < pieces_.size() && pieces_[end].texel == texel; ++end) {
      const Piece& piece = pieces_[end];
      const V3f n = normal(piece.facet);
      const uint8_t m = material(piece.facet);
      const auto newest = groups.rbegin(), oldest = newest + std::min<std::ptrdiff_t>(looked_back, std::ssize(groups));
      const auto like = std::find_if(newest, oldest, [&](const Group& g) {
        return g.material == m && !(g.mask & piece.mask) &&
               std::abs(dot(g.first_normal, n)) >= ImageNumbers::merge_cosine &&
               continues(g.first, g.first_normal, piece);
      });
      Group& group = like != oldest ? *like : groups.emplace_back();
      group.material = m;
      group.add(piece, n);
    }
    std::stable_sort(groups.begin(), groups.end(),
                     [](const Group& a, const Group& b) { return a.height() > b.height(); });
    if (layers > 0) limit_layers(layers, &groups);
    while (next_texel <= texel) out.image.first[next_texel++] = uint32_t(out.image.fragments.size());
    for (const Group& g : groups) {
      Fragment f;
      f.depth = uint16_t(std::lround(std::clamp((radius_ - g.height()) / (2 * radius_), 0.0f, 1.0f) * 65535));
      f.mask = uint16_t(g.mask);
      f.plane_normal = encode_normal(length2(g.normals) > 0 ? normalize(g.normals) : g.first_normal);
      f.material = g.material;
      out.image.fragments.push_back(f);
      out.sources.push_back(g.largest);
    }
  }
  while (next_texel < out.image.first.size()) out.image.first[next_texel++] = uint32_t(out.image.fragments.size());
  return out;
}

}  // namespace dapple::depthimage
