// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "dapple/base/stop_token.h"
#include "dapple/forest/irradiance_table.h"
#include "dapple/scene/scene.h"
#include "dapple/vegetation/canopy_factors.h"
#include "dapple/vegetation/canopy_survey.h"

namespace dapple::vegetation {

/// Light that was scattered at least once inside a scene's vegetation, as a function of height and normal:
/// plane-parallel radiance transport (Max, Mobley, Keating and Wu 1997; illumination under trees, section 5) through
/// the leaf statistics of a plot, lit by the scene's lights at infinity. z is up, metres.
///
/// Clumps. Where leaves stand in crowns, the solver's leaves are the clumps: their area is Omega u, Omega from gaps
/// (Nilson 1971), for light from above and from below. Of what leaves of a clump scatter, the part p = 1 - Omega meets
/// leaves of the same clump again (recollision probability; Smolander and Stenberg 2005). So for a leaf albedo w a
/// clump's is w (1 - p) / (1 - p w); and with E_a, E_b of the solution from above and below, D the mean of direct light
/// over both sides of a leaf that is not shaded by its clump, a leaf gets
///   E = (Omega_a E_a + Omega_b E_b + p w Omega_a D) / (1 - p w).
/// Leaves at random have Omega = 1, p = 0: the solution as it is.
class CanopyTransport {
 public:
  struct Settings {
    std::optional<Box2f> plot;  ///< where leaves are counted; else the scene's period, or the extent of what transmits
                                ///< less a border as wide as it is high
    int slabs = 20, inclinations = 9;
    int nodes = 8, modes = 4;               ///< of the solver
    uint32_t gap_rays = 2048;               ///< for clumping; a direction and slab
    std::vector<int32_t> ground_materials;  ///< as CanopySurveyOptions
    SurveyEffort effort = {};
    StopToken stop = {};  ///< asked between the steps of the construction, which throws Stopped then
  };
  using Sides = forest::IrradianceTable::Sides;

  /// The scene is not used after construction. std::invalid_argument where there is no canopy.
  CanopyTransport(const scene::Scene& scene, const Settings& settings);
  /// The same where optics_of_geometries() are known.
  CanopyTransport(const scene::Scene& scene, const Settings& settings, const std::vector<SurfaceOptics>& optics);

  /// What scattered() is multiplied by from now on.
  void set_factors(CanopyFactors factors) { factors_ = std::move(factors); }
  const CanopyFactors& factors() const { return factors_; }

  /// P is on a leaf, and within the vegetation's extent.
  bool is_leaf(uint32_t geometry, const V3f& P) const { return is_leaf_[geometry] && has(P); }
  /// Irradiance at P of a geometry, without the light that comes from sun and sky directly. Zero beyond the
  /// vegetation's extent.
  Sides scattered(uint32_t geometry, const V3f& P, const V3f& n) const {
    if (!has(P)) return {};
    Sides sides = (is_ground_[geometry] ? ground_ : leaves_).at(P.z, n);
    const RGB factor = factors_.at(P.z, n);
    sides.front *= factor;
    sides.behind *= factor;
    return sides;
  }

  const ClumpingProfile& clumping() const { return clumping_; }

 private:
  struct Solution;
  bool has(const V3f& P) const {
    return P.x >= extent_.min.x && P.x <= extent_.max.x && P.y >= extent_.min.y && P.y <= extent_.max.y;
  }
  void combine(const CanopySurvey& survey, const Solution& s);

  Box2f extent_;
  ClumpingProfile clumping_;
  std::vector<uint8_t> is_ground_, is_leaf_;  // by geometry
  CanopyFactors factors_;
  forest::IrradianceTable ground_, leaves_;
};

}  // namespace dapple::vegetation
