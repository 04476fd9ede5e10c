// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/base/hash.h"
#include "dapple/pattern/shading_points.h"
#include "dapple/pattern/texture.h"

namespace dapple::pattern::test {

/// A full batch of random points with random footprints of about `width`. Large: made on the heap.
inline std::unique_ptr<ShadingPoints> random_points(uint64_t seed, float width, float extent = 4) {
  auto points = std::make_unique<ShadingPoints>();
  points->count = ShadingPoints::capacity;
  KeyedRng rng(seed);
  const auto in = [&](float r) { return r * (2 * rng.next() - 1); };
  const auto in3 = [&](float r) {
    const float x = in(r), y = in(r);
    return V3f(x, y, in(r));
  };
  for (int i = 0; i < points->count; ++i) {
    points->P.set(i, in3(extent));
    const V3f n = normalize(in3(1));
    points->Ng.set(i, n);
    points->Ns.set(i, n);
    points->dPdx.set(i, in3(width));
    points->dPdy.set(i, in3(width));
    points->u[i] = in(extent);
    points->v[i] = in(extent);
    points->dudx[i] = in(width);
    points->dudy[i] = in(width);
    points->dvdx[i] = in(width);
    points->dvdy[i] = in(width);
    points->time[i] = 0;
    points->key[i] = rng.next_bits();
  }
  return points;
}

template <class T>
T value_at(const Texture<T>& texture, float u, float v, float width = 0) {
  const auto points = random_points(1, 0);
  points->count = 1;
  points->u[0] = u;
  points->v[0] = v;
  points->dudx[0] = points->dvdy[0] = width;
  T out[ShadingPoints::capacity];
  texture.evaluate(*points, out);
  return out[0];
}

template <class T>
T value_at(const Texture<T>& texture, const V3f& p, float width = 0) {
  const auto points = random_points(1, 0);
  points->count = 1;
  points->P.set(0, p);
  points->dPdx.set(0, {width, 0, 0});
  points->dPdy.set(0, {0, width, 0});
  T out[ShadingPoints::capacity];
  texture.evaluate(*points, out);
  return out[0];
}

}  // namespace dapple::pattern::test
