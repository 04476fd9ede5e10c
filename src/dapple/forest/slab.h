// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/pack.h"

namespace dapple::forest {

/// Memory that the functions of a slab need; one for each thread. Reused, so that nothing is allocated per slab.
class Scratch {
 public:
  explicit Scratch(int nodes) : n_(nodes), packs_(matrices * size_t(nodes) * nodes) {}
  Pack* matrix(int k) { return packs_.data() + size_t(k) * n_ * n_; }
  static constexpr int matrices = 16;

 private:
  int n_;
  std::vector<Pack> packs_;
};

/// Homogeneous slab of unit thickness for four systems (5.4-5.6). Radiances are scaled by sqrt(w_i mu_i), which makes
/// all matrices symmetric; P, Q of the text enter as m1 = P - Q and m2 = P + Q, for the slab's whole content:
///   d(u - d)/dz = m2 (u + d),  d(u + d)/dz = m1 (u - d)      u up, d down, z upwards.
struct SlabView {
  int n = 0;
  const Pack* m1 = nullptr;
  const Pack* m2 = nullptr;
  const Pack* r = nullptr;  ///< reflection
  const Pack* t = nullptr;  ///< transmission of diffuse light, the uncollided included
};

/// r and t of a slab from m1 and m2. `depth` is its largest optical path along a node, kappa / mu. A slab of path at
/// most 6 is done at once: with h half its thickness, r + t = (1 + T) / (1 - T) for T = m2 tanh(sqrt(m1 m2) h) /
/// sqrt(m1 m2), and -(r - t) likewise with m1 and m2 exchanged, where tanh is the quotient that the (15, 15) Pade form
/// of the exponential gives (error below 1e-14). Thicker ones by doubling. Linear invariants, and so energy, are kept
/// to round-off.
void make_slab(int n, const Pack* m1, const Pack* m2, double depth, Pack* r, Pack* t, Scratch& scratch);

/// Solves for what a slab does along one further direction of path k = kappa / mu through it: the matrix k^2 - m2 m1 of
/// both the source of a beam and the line integral of a view. It is singular where k is an eigenvalue, though the
/// result is regular: then four values of k beside it are averaged to fourth order, an error of some 1e-12.
class DirectionSolver {
 public:
  DirectionSolver() = default;
  DirectionSolver(const SlabView& slab, double k, Scratch& scratch);

  /// What leaves a slab upwards (s_u) and downwards (s_d) for a beam that is scattered into the nodes at rates ju (up)
  /// and jd (down) per unit thickness at the slab's top, and falls off as exp(-k) downwards (5.6). n packs each.
  void beam(const SlabView& slab, const Pack* ju, const Pack* jd, Pack* s_u, Pack* s_d, Scratch& scratch) const;

  /// Integrals over the slab of the diffuse radiances u and d, weighted by exp(-k times the way to the end of the slab
  /// that the view looks from: top for `upward` light, bottom otherwise). The radiances at the slab's bottom (u0, d0)
  /// and top (u1, d1) determine them, with a beam of path k0 and rates ju, jd at the top, or null. Results in v_u, v_d.
  void view(const SlabView& slab, bool upward, const Pack* u0, const Pack* d0, const Pack* u1, const Pack* d1,
            double k0, const Pack* ju, const Pack* jd, Pack* v_u, Pack* v_d, Scratch& scratch) const;

 private:
  struct Shift {
    double k, weight;
  };
  std::vector<Shift> shifts_;
  std::vector<Pack> lu_;  // one matrix for each shift
};

/// (1 - e^-x) / x without cancellation.
double slant(double x);
/// (e^-a - e^-b) / (b - a) without cancellation.
double slant_difference(double a, double b);

}  // namespace dapple::forest
