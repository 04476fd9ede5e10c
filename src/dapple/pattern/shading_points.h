// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "dapple/base/vec.h"

namespace dapple::pattern {

/// Three floats for each lane of a batch.
template <int N>
struct Lanes3 {
  alignas(64) float x[N], y[N], z[N];
  V3f operator[](int i) const { return {x[i], y[i], z[i]}; }
  void set(int i, const V3f& v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
};

/// A batch of surface points to be shaded, structure of arrays. Everything here is independent of the view: no
/// direction to the eye is given, so that it can be cached (Christensen et al. 2012, "Multiresolution radiosity
/// caching"). World space.
struct ShadingPoints {
  static constexpr int capacity = 256;

  int count = 0;
  Lanes3<capacity> P;   ///< position
  Lanes3<capacity> Ng;  ///< unit geometric normal, on the outside of the surface (after ReverseOrientation)
  Lanes3<capacity>
      Ns;  ///< unit shading normal, same side as Ng; bump and normal maps are applied later, by the material
  Lanes3<capacity> dPdu, dPdv;  ///< of the surface's parametrisation
  Lanes3<capacity> dNdu, dNdv;  ///< change of Ns; zero on flat surfaces
  Lanes3<capacity> dPdx, dPdy;  ///< footprint: change of P from one sample to its neighbour; zero = unfiltered
  alignas(64) float u[capacity], v[capacity];
  alignas(64) float dudx[capacity], dudy[capacity], dvdx[capacity], dvdy[capacity];  ///< footprint in u, v
  alignas(64) float time[capacity];
  alignas(64) uint64_t key[capacity];  ///< random key of the point, for stochastic choices (mix, alpha)

  /// Copies lane `from` of `other` to lane `to`.
  void copy_lane(int to, const ShadingPoints& other, int from);
  /// The lanes of `other` named by `lanes`, in that order.
  void gather(const ShadingPoints& other, std::span<const int> lanes);
};

}  // namespace dapple::pattern
