// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/shafts/lamp_light.h"

namespace dapple::shafts {

/// A part of a view ray, from the eye along unit d.
struct Segment {
  V3f d;
  float begin = 0, end = 0;  ///< m from the eye; the end may be infinite
  float xi = 0;              ///< in [0, 1): chooses one of two planes
  V3f off{0, 0, 0};          ///< of parallel view rays: where they begin, from the eye
};

/// Light that haze scatters from a beam straight to the eye, where nothing stands in the way:
///   int_begin^end sigma_s p e^-(depth from `begin` + depth to the light) ds,
/// in closed form over runs of lit bins. With l(s) the column from `begin` (media/exponential_density.h), both depths
/// together are sigma_t (k l + c), linear in l, since in layered haze the column to the sun falls as that along the
/// view grows: k = 1 - cos phi where the density is even, k = 1 - mu_v / mu_s where it falls with height; mu: the sines
/// of elevation of view and sun. So a run [a, b] of l brings
///   sigma_s p e^-(sigma_t (k a + c)) (b - a) m(sigma_t k (b - a)),  m(y) = (1 - e^-y) / y,
/// without special cases: thin haze, level rays, rays to the sun and beside it are limits of m. To a lamp at distance
/// D, ds / r^2 = dpsi / (D sin phi), whose integrand is smooth. Blocks of bins that are not lit as a whole, and all of
/// lamps: block_light.h.
class AirLight {
 public:
  /// The planes must outlive this object. Parallel light of an unbounded medium: its density must fall towards the
  /// light, or no light arrives.
  AirLight(const ScanPlanes& planes, const Haze& haze);

  /// Of a beam of irradiance 1 across it, or a lamp of intensity 1 (1/sr; 1/(m2 sr)).
  RGB in_scattering(const Segment& segment) const;

  /// What is lit of pieces of the ray, one behind the other, from begin[i] to end[i] m behind `segment.begin`: metres,
  /// or of a lamp int ds / r^2, 1/m; times the tint of its rays of light. Returns the plane.
  int lit(const Segment& segment, const float* begin, const float* end, int n, RGB* out) const;

  /// What entry() of the planes holds for a ray of light that enters the medium at point P.
  float entry_of(const V3f& P) const;

  const ScanPlanes& planes() const { return planes_; }

 private:
  ViewRay view_of(const Segment& segment) const;
  void set_coordinates(ViewRay* view) const;
  RGB lit_of(const ViewRay& view, int* block) const;
  RGB parallel(const Segment& segment) const;
  RGB from_lamp(const Segment& segment) const;
  void scan(const ViewRay& view, LightSums* sums) const;
  float place_of(const ViewRay& view, int block) const;
  void add_whole(const ViewRay& view, const BlockNodes& nodes, BlockStates* states, LightSums* sums) const;
  void add_block(const ViewRay& view, const BlockNodes& nodes, int block, LightSums* sums) const;
  void add_run(const ViewRay& view, float begin, float end, LightSums* sums) const;
  // Of parallel light; LampLight has the same.
  void find_states(const ViewRay& view, int first, int n, BlockStates* states) const;
  void find_nodes(const ViewRay& view, int first, BlockNodes* nodes) const;
  void cut_bins(const ViewRay& view, int block, LitBins* lit) const;
  void add_steep_bins(const ViewRay& view, int block, LightSums* sums) const;
  int sums_wanted() const { return planes_.tinted() ? 3 : channels_; }

  const ScanPlanes& planes_;
  const Haze haze_;
  std::optional<LampLight> lamp_;
  float rise_ = 0;         // slope . axis, kept away from 0
  int channels_ = 3;       // 1: all alike
  bool unbounded_ = true;  // all rays of light come from infinity through the medium
};

}  // namespace dapple::shafts
