// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/splat_object.h"

#include <algorithm>

#include "dapple/depthimage/image_numbers.h"
#include "dapple/numeric/morton.h"

namespace dapple::depthimage {

namespace {

struct Placed {
  uint64_t key = 0;  // along Morton's curve
  V3f P;
  const Fragment* fragment = nullptr;
};

// Where the normal lies too far across the view, as steep as it may be.
V2f slopes(const V3f& n, const ViewFrame& frame, float most) {
  const float across = std::max(std::abs(dot(n, frame.w)), 1e-6f) * (dot(n, frame.w) < 0 ? -1.0f : 1.0f);
  V2f s(-dot(n, frame.u) / across, -dot(n, frame.v) / across);
  const float steep = s.length();
  return steep > most ? s * (most / steep) : s;
}

void set_rectangle(unsigned mask, SplatLevel::Lanes* to, uint32_t lane) {
  constexpr int side = SampleMask::side, step = 100 / side;
  const auto more = [mask](unsigned border) {
    return (mask & border) == border ? int(100 * ImageNumbers::overlap + 0.5f) : 0;
  };
  const auto set = [&](unsigned lines, unsigned first_border, unsigned last_border, int8_t* low, int8_t* high) {
    low[lane] = int8_t(std::countr_zero(lines) * step - 50 - more(first_border));
    high[lane] = int8_t(int(std::bit_width(lines)) * step - 50 + more(last_border));
  };
  unsigned rows = 0;
  for (int row = 0; row < side; ++row) rows |= unsigned((mask >> (row * side) & 15u) != 0) << row;
  set((mask | mask >> 4 | mask >> 8 | mask >> 12) & 15u, 0x1111, 0x8888, to->left, to->right);
  set(rows, 0xf, 0xf000, to->bottom, to->top);
}

float most_slope(const ObjectImages& o) {
  return o.layers > 0 ? SplatObject::steepest : SplatObject::steepest_owned;
}

std::vector<Placed> place(const ObjectImages& o, const ImageLevel& level, const ViewFrame& frame,
                          const LayeredImage& image) {
  std::vector<Placed> out;
  out.reserve(image.fragments.size());
  const float t = o.texel(level), to_grid = 1023 / (2 * o.radius);
  for (int row = 0; row < level.resolution; ++row)
    for (int column = 0; column < level.resolution; ++column) {
      const size_t texel = size_t(row) * size_t(level.resolution) + size_t(column);
      for (uint32_t f = image.first[texel]; f < image.first[texel + 1]; ++f) {
        const Fragment& fragment = image.fragments[f];
        const V2f off = V2f(0.5f, 0.5f) - SampleMask::centroid(fragment.mask);
        const V2f slope = slopes(decode_normal(fragment.plane_normal), frame, most_slope(o));
        const V3f P = o.position(level, frame, column, row, fragment) +
                      (frame.u * off.x + frame.v * off.y + frame.w * (off.x * slope.x + off.y * slope.y)) * t;
        uint64_t key = 0;
        for (int k = 0; k < 3; ++k)
          key |= spread_bits_by_3(uint32_t(std::clamp((P[k] - o.centre[k] + o.radius) * to_grid, 0.0f, 1023.0f))) << k;
        out.push_back({key, P, &fragment});
      }
    }
  std::stable_sort(out.begin(), out.end(), [](const Placed& a, const Placed& b) { return a.key < b.key; });
  return out;
}

void add_view(const std::vector<Placed>& placed, uint32_t view, const ViewFrame& frame, float steepest,
              SplatLevel* to) {
  for (size_t begin = 0; begin < placed.size(); begin += SplatLevel::chunk_size) {
    SplatLevel::Chunk chunk;
    chunk.count = uint32_t(std::min<size_t>(SplatLevel::chunk_size, placed.size() - begin));
    chunk.view = view;
    SplatLevel::Lanes& lanes = to->lanes.emplace_back();
    for (uint32_t i = 0; i < uint32_t(SplatLevel::chunk_size); ++i) {
      const Placed& p = placed[begin + std::min(i, chunk.count - 1)];
      const V2f slope = slopes(decode_normal(p.fragment->plane_normal), frame, steepest);
      chunk.box.extendBy(p.P);
      lanes.x[i] = p.P.x, lanes.y[i] = p.P.y, lanes.z[i] = p.P.z;
      lanes.slope_u[i] = slope.x, lanes.slope_v[i] = slope.y;
      lanes.mask[i] = p.fragment->mask;
      set_rectangle(p.fragment->mask, &lanes, i);
      to->fragments.push_back(*p.fragment);
    }
    to->chunks.push_back(chunk);
  }
}

void add_spheres(SplatLevel* level) {
  constexpr size_t count = SplatLevel::Spheres::count;
  for (size_t begin = 0; begin < level->chunks.size(); begin += count) {
    SplatLevel::Spheres& to = level->spheres.emplace_back();
    for (size_t i = 0; i < count; ++i) {
      const Box3f& box = level->chunks[std::min(begin + i, level->chunks.size() - 1)].box;
      const V3f middle = (box.min + box.max) * 0.5f;
      to.x[i] = middle.x, to.y[i] = middle.y, to.z[i] = middle.z, to.radius[i] = 0.5f * length(box.max - box.min);
    }
  }
}

}  // namespace

SplatObject::SplatObject(const ObjectImages& images)
    : centre(images.centre),
      radius(images.radius),
      box(images.box),
      one_sided(images.layers > 0),
      materials(images.materials) {
  for (const V3f& d : images.directions) frames.emplace_back(d);
  for (const ImageLevel& level : images.levels) {
    SplatLevel to;
    to.texel = images.texel(level);
    for (uint32_t view = 0; view < frames.size(); ++view)
      add_view(place(images, level, frames[view], level.views[view]), view, frames[view], most_slope(images), &to);
    add_spheres(&to);
    levels.push_back(std::move(to));
  }
}

SplatObject::Surface SplatObject::surface(const SplatLevel& level, uint32_t view, uint32_t i) const {
  const Fragment& f = level.fragments[i];
  const ImageMaterial& m = materials[f.material];
  const ViewFrame& frame = frames[view];
  const V2f off = SampleMask::centroid(f.mask) - V2f(0.5f, 0.5f);
  const SplatLevel::Lanes& lanes = level.lanes[i / SplatLevel::chunk_size];
  const uint32_t lane = i % SplatLevel::chunk_size;
  Surface s;
  s.P = V3f(lanes.x[lane], lanes.y[lane], lanes.z[lane]) +
        (frame.u * off.x + frame.v * off.y + frame.w * (off.x * lanes.slope_u[lane] + off.y * lanes.slope_v[lane])) *
            level.texel;
  s.plane_normal = decode_normal(f.plane_normal);
  s.normal = decode_normal(f.shading_normal);
  for (int c = 0; c < 3; ++c) {
    s.reflectance[c] = decode_share(f.reflectance[c], m.reflectance[c]);
    s.transmittance[c] = decode_share(f.transmittance[c], m.transmittance[c]);
  }
  return s;
}

// A side of the parallelogram, d, moves X / W by (d_X - x d_W) / W.
float SplatObject::reach(const ScreenMap& map, const V2i& film) const {
  const float steep = one_sided ? steepest : steepest_owned;
  float most = 0;
  for (int corner = 0; corner < 4; ++corner)
    for (const auto& [row, at] : {std::pair{ScreenMap::X, corner & 1 ? float(film.x) : 0.0f},
                                  {ScreenMap::Y, corner & 2 ? float(film.y) : 0.0f}}) {
      const V3f change(map.m[row][0] - at * map.m[ScreenMap::W][0], map.m[row][1] - at * map.m[ScreenMap::W][1],
                       map.m[row][2] - at * map.m[ScreenMap::W][2]);
      most = std::max(most, length(change));
    }
  // Two sides of which each is at most sqrt(1 + its slope^2) long, the slopes' squares adding up to steep^2; by halves.
  return most * std::sqrt(1 + 0.5f * sqr(steep)) * 1.05f;
}

size_t SplatLevel::bytes() const {
  return spheres.size() * sizeof(Spheres) + lanes.size() * sizeof(Lanes) + fragments.size() * sizeof(Fragment) +
         chunks.size() * sizeof(Chunk);
}

size_t SplatObject::bytes() const {
  size_t sum = 0;
  for (const SplatLevel& level : levels) sum += level.bytes();
  return sum;
}

}  // namespace dapple::depthimage
