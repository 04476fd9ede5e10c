// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/hash.h"
#include "dapple/depthimage/image_builder.h"

namespace dapple::test {

struct Triangle {
  V3f p[3];
  V3f normal() const { return normalize(cross(p[1] - p[0], p[2] - p[0])); }
  float area() const { return 0.5f * length(cross(p[1] - p[0], p[2] - p[0])); }
};

inline V3f random_point(KeyedRng& rng, float reach) {
  return V3f(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1) * reach;
}

/// The images of triangles about the origin, radius 1, as impostor::ObjectBaker makes them of a scene's: all layers,
/// each in the view that sees it most squarely; or limited layers, each in all views. White; material 0.
inline depthimage::ObjectImages images_of(const std::vector<Triangle>& triangles, const std::vector<V3f>& directions,
                                          int finest, int layers = 0) {
  using namespace depthimage;
  ObjectImages o;
  o.name = "triangles";
  o.radius = 1;
  o.box = Box3f(V3f(-1), V3f(1));
  o.layers = layers;
  o.directions = directions;
  o.materials.push_back({RGB(1), RGB(0)});
  for (int n = finest; n >= std::min(finest, 8); n /= 2) {
    ImageLevel level{n, {}};
    for (size_t view = 0; view < directions.size(); ++view) {
      ImageBuilder builder(ViewFrame(directions[view]), o.centre, o.radius, n);
      for (uint32_t t = 0; t < triangles.size(); ++t) {
        size_t owner = 0;
        for (size_t v = 1; v < directions.size(); ++v)
          if (std::abs(dot(triangles[t].normal(), directions[v])) >
              std::abs(dot(triangles[t].normal(), directions[owner])))
            owner = v;
        if (layers > 0 || owner == view) builder.add(t, triangles[t].p);
      }
      auto folded = builder.fold(
          layers, [&](uint32_t t) { return triangles[t].normal(); }, [](uint32_t) { return uint8_t(0); });
      for (Fragment& f : folded.image.fragments) {
        f.shading_normal = f.plane_normal;
        for (int c = 0; c < 3; ++c) f.reflectance[c] = 255;
      }
      level.views.push_back(std::move(folded.image));
    }
    o.levels.push_back(std::move(level));
  }
  return o;
}

/// A square about a centre, sides along two vectors of half its width.
inline void add_square(const V3f& centre, const V3f& a, const V3f& b, std::vector<Triangle>* to) {
  to->push_back({{centre - a - b, centre + a - b, centre + a + b}});
  to->push_back({{centre - a - b, centre + a + b, centre - a + b}});
}

}  // namespace dapple::test
