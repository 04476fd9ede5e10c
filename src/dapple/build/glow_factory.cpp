// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/glow_factory.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/build/medium_places.h"
#include "dapple/media/closed_form_medium.h"
#include "dapple/media/uneven_medium.h"

namespace dapple::build {

namespace {

constexpr int most_cells = 32;     // along an axis
constexpr int most_even = 12;      // the same of media that are even, where only their shape is to be found
constexpr int looks_each_way = 2;  // into a cell
constexpr int looks = looks_each_way * looks_each_way * looks_each_way;

bool has_extent(const Box3f& box) {
  const V3f size = box.isEmpty() ? V3f(0, 0, 0) : box.size();
  return size.x > 0 && size.y > 0 && size.z > 0 && std::isfinite(size.x * size.y * size.z);
}

// What a medium emits and absorbs at places.
struct Emission {
  const media::UnevenMedium* uneven;
  const media::ClosedFormMedium* even;

  explicit Emission(const media::Medium& medium)
      : uneven(dynamic_cast<const media::UnevenMedium*>(&medium)),
        even(dynamic_cast<const media::ClosedFormMedium*>(&medium)) {}

  void look(const V3f* P, RGB* emitted, RGB* absorption) const {
    media::MediumPoint found[looks];
    if (uneven) uneven->coefficients(P, 0, looks, found);
    for (int i = 0; i < looks; ++i) {
      emitted[i] = uneven ? found[i].sigma_a * found[i].emission : even->emission_at(P[i]);
      absorption[i] = uneven ? found[i].sigma_a : (even->sigma_t() - even->sigma_s()) * even->density().at(P[i]);
      if (!emitted[i].is_finite() || !absorption[i].is_finite()) emitted[i] = absorption[i] = RGB();
    }
  }
};

// Of a layer of cells, sums over what was looked at.
struct LayerSums {
  RGB emitted, absorption;  ///< the latter weighted by what is emitted
  int glowing = 0;
};

// What a body emits leaves it but for what it absorbs itself: of a convex one the mean way through it is 4 V / S, of a
// cube 2/3 of its side.
RGB escaping(const LayerSums& all, double volume_of_look) {
  const float way = float(std::cbrt(double(all.glowing) * volume_of_look)) * 2 / 3;
  RGB out = all.emitted * float(volume_of_look);
  for (int c = 0; c < 3; ++c)
    if (all.emitted[c] > 0) out[c] *= media::mean_decay(all.absorption[c] / all.emitted[c] * way);
  return out;
}

// `only`: places that lie in no shape with the medium are dark; null: all are in it.
emitters::GlowCells cells_of(const Emission& medium, const Box3f& box, const MediumPlaces* only, int32_t number) {
  emitters::GlowCells out;
  out.box = box;
  const V3f size = box.size();
  const int most = medium.uneven ? most_cells : most_even;
  const float edge = std::max({size.x, size.y, size.z}) / float(most);
  const auto count = [&](float length) { return std::clamp(int(std::ceil(length / edge - 1e-3f)), 1, most); };
  out.nx = count(size.x), out.ny = count(size.y), out.nz = count(size.z);
  out.emitted.resize(size_t(out.nx) * size_t(out.ny) * size_t(out.nz));
  std::vector<LayerSums> layers(size_t(out.nz));
  parallel_for(layers.size(), [&](size_t z) {
    V3f P[looks];
    RGB emitted[looks], absorption[looks];
    bool there[looks];
    for (int y = 0; y < out.ny; ++y)
      for (int x = 0; x < out.nx; ++x) {
        for (int i = 0; i < looks; ++i) {
          const auto place = [](int cell, int look) { return float(cell) + (float(look) + 0.5f) / looks_each_way; };
          const V3f at(place(x, i & 1) / float(out.nx), place(y, i >> 1 & 1) / float(out.ny),
                       place(int(z), i >> 2) / float(out.nz));
          P[i] = box.min + V3f(at.x * size.x, at.y * size.y, at.z * size.z);
          there[i] = true;
        }
        medium.look(P, emitted, absorption);
        if (only && std::any_of(emitted, emitted + looks, [](const RGB& e) { return !e.is_black(); }))
          only->find(number, P, looks, there);
        float sum = 0;
        for (int i = 0; i < looks; ++i) {
          if (!there[i] || !(emitted[i].luminance() > 0)) continue;
          sum += emitted[i].luminance();
          layers[z].emitted += emitted[i];
          layers[z].absorption += emitted[i] * absorption[i];
          ++layers[z].glowing;
        }
        out.emitted[(z * size_t(out.ny) + size_t(y)) * size_t(out.nx) + size_t(x)] = sum / looks;
      }
  });
  LayerSums all;
  for (const LayerSums& layer : layers) {
    all.emitted += layer.emitted, all.absorption += layer.absorption;
    all.glowing += layer.glowing;
  }
  out.intensity = escaping(all, double(size.x) * size.y * size.z / double(out.emitted.size() * looks));
  return out;
}

bool glows(const emitters::GlowCells& cells) {
  return cells.intensity.luminance() > 0 && cells.intensity.is_finite();
}

void add_glow(const Emission& medium, const Box3f& place, const Box3f& box, const MediumPlaces* only, int32_t number,
              std::vector<GlowPlace>* out) {
  if (!has_extent(box)) return;
  GlowPlace glow{number, place, cells_of(medium, box, only, number)};
  // Shapes so thin that no place was in them.
  if (!glows(glow.cells) && only) glow.cells = cells_of(medium, box, nullptr, number);
  if (glows(glow.cells)) out->push_back(std::move(glow));
}

}  // namespace

std::vector<GlowPlace> find_glow(const scene::Scene& scene) {
  std::vector<GlowPlace> out;
  const auto emits = [](const auto& medium) { return medium && medium->emits(); };
  // Positions in scenes that repeat may lie in any copy.
  if (scene.traced.period() || std::none_of(scene.media.begin(), scene.media.end(), emits)) return out;
  const MediumPlaces places(scene);
  for (size_t i = 0; i < scene.media.size(); ++i) {
    const int32_t number = int32_t(i);
    if (!emits(scene.media[i])) continue;
    const Emission medium(*scene.media[i]);
    if (places.is_anywhere(number)) {
      if (medium.uneven) add_glow(medium, everywhere(), medium.uneven->bounds(), nullptr, number, &out);
      continue;
    }
    for (const Box3f& place : places.boxes(number)) {
      Box3f box = place;
      for (int k = 0; medium.uneven && k < 3; ++k) {
        box.min[k] = std::max(box.min[k], medium.uneven->bounds().min[k]);
        box.max[k] = std::min(box.max[k], medium.uneven->bounds().max[k]);
      }
      add_glow(medium, place, box, &places, number, &out);
    }
  }
  return out;
}

}  // namespace dapple::build
