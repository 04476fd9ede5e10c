// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/glow_factory.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/media/uneven_medium.h"

namespace dapple::build {

namespace {

constexpr int most_cells = 32;     // along an axis
constexpr int looks_each_way = 2;  // into a cell

bool has_extent(const Box3f& box) {
  const V3f size = box.isEmpty() ? V3f(0, 0, 0) : box.size();
  return size.x > 0 && size.y > 0 && size.z > 0 && std::isfinite(size.x * size.y * size.z);
}

emitters::GlowCells cells_of(const media::UnevenMedium& medium) {
  emitters::GlowCells out;
  out.box = medium.bounds();
  const V3f size = out.box.size();
  const float edge = std::max({size.x, size.y, size.z}) / most_cells;
  const auto count = [&](float length) { return std::clamp(int(std::ceil(length / edge - 1e-3f)), 1, most_cells); };
  out.nx = count(size.x), out.ny = count(size.y), out.nz = count(size.z);
  out.emitted.resize(size_t(out.nx) * size_t(out.ny) * size_t(out.nz));
  std::vector<RGB> layers(size_t(out.nz));
  parallel_for(layers.size(), [&](size_t z) {
    constexpr int looks = looks_each_way * looks_each_way * looks_each_way;
    V3f P[looks];
    media::MediumPoint found[looks];
    for (int y = 0; y < out.ny; ++y)
      for (int x = 0; x < out.nx; ++x) {
        for (int i = 0; i < looks; ++i) {
          const auto place = [](int cell, int look) { return float(cell) + (float(look) + 0.5f) / looks_each_way; };
          const V3f at(place(x, i & 1) / float(out.nx), place(y, i >> 1 & 1) / float(out.ny),
                       place(int(z), i >> 2) / float(out.nz));
          P[i] = out.box.min + V3f(at.x * size.x, at.y * size.y, at.z * size.z);
        }
        medium.coefficients(P, 0, looks, found);
        RGB sum;
        for (const media::MediumPoint& p : found) sum += p.sigma_a * p.emission;
        if (!sum.is_finite()) continue;
        layers[z] += sum * (1.0f / looks);
        out.emitted[(z * size_t(out.ny) + size_t(y)) * size_t(out.nx) + size_t(x)] =
            std::max(sum.luminance(), 0.0f) / looks;
      }
  });
  for (const RGB& layer : layers) out.intensity += layer;
  out.intensity *= size.x * size.y * size.z / float(out.emitted.size());
  return out;
}

}  // namespace

std::vector<emitters::GlowCells> find_glow(scene::Scene* scene) {
  scene->glowing.assign(scene->media.size(), false);
  std::vector<bool> used(scene->media.size(), false);
  const auto use = [&](int32_t medium) {
    if (medium != scene::vacuum) used[size_t(medium)] = true;
  };
  use(scene->camera_medium);
  for (const scene::GeometryBinding& b : scene->bindings)
    if (b.changes_medium) use(b.inside_medium), use(b.outside_medium);
  std::vector<emitters::GlowCells> out;
  for (size_t i = 0; i < scene->media.size(); ++i) {
    const auto* medium = dynamic_cast<const media::UnevenMedium*>(scene->media[i].get());
    if (!used[i] || !medium || !medium->emits() || !has_extent(medium->bounds())) continue;
    emitters::GlowCells cells = cells_of(*medium);
    if (!(cells.intensity.luminance() > 0) || !cells.intensity.is_finite()) continue;
    scene->glowing[i] = true;
    out.push_back(std::move(cells));
  }
  return out;
}

}  // namespace dapple::build
