// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/forest/leaf_survey.h"
#include "dapple/scene/scene.h"
#include "dapple/vegetation/canopy_numbers.h"
#include "dapple/vegetation/surface_facets.h"

namespace dapple::vegetation {

/// Leaf statistics of a scene's plot, from the surfaces that rays would meet, instances included, and the means of
/// their materials. z is up, metres.
struct CanopySurvey {
  /// A material where it stands in the canopy. Surfaces of a material that transmits are leaves with two sides; opaque
  /// ones, but for disks, are taken as closed (bark), and half of their area counts: so much they would have if they
  /// were leaves.
  struct Kind {
    int32_t material = 0;                                  ///< of the scene
    bool flat = true;                                      ///< all of the area counts
    std::array<double, 3> reflectance{}, transmittance{};  ///< means over the area, by channel
    double opaque = 1;                                     ///< part of the area that is not cut out (counted already)
    double area_m2 = 0;                                    ///< that counts, in the plot
  };
  std::vector<Kind> kinds;
  forest::LeafSurvey areas;
  bool has_ground = false;
  double ground_z = 0, top_z = 0;  ///< world
  std::array<double, 3> ground{};  ///< mean reflectance
  size_t left_out = 0;             ///< curves, which have no polygons
  std::vector<uint8_t> is_ground;  ///< by geometry of the scene
};

/// How much is counted; CanopyNumbers say what fewer do.
struct SurveyEffort {
  size_t facets = CanopyNumbers::most_facets;  ///< at most, of instances, by sample_canopy()
  size_t placed = CanopyNumbers::most_placed;  ///< at most, of instances in objects or from files
};

struct CanopySurveyOptions {
  Box2f plot;
  int slabs = 10, inclinations = 18;
  std::vector<int32_t>
      ground_materials;  ///< empty: opaque shapes that span nine tenths of the plot along x and y are the ground
  SurveyEffort effort = {};
};

/// mean_optics() of all geometries of a scene, which the functions below are given.
std::vector<SurfaceOptics> optics_of_geometries(const scene::Scene& scene);

/// By geometry: it transmits light diffusely.
std::vector<uint8_t> leaf_geometries(const std::vector<SurfaceOptics>& optics);

/// x and y of what transmits light, such as leaves; empty where nothing does.
Box2f vegetation_extent(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                        const SurveyEffort& effort = {});

/// Surfaces of ground materials are no canopy; heights in `areas` are above the mean of the ground, or the lowest point
/// where there is none. std::invalid_argument if nothing is above it.
CanopySurvey survey_canopy(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                           const CanopySurveyOptions& options);

/// Gaps and clumping (Nilson 1971): P(mu) is the fraction of parallel rays of downward cosine mu that cross from
/// `top_z` over the plot to `ground_z` at the middle of the shutter; Omega(mu) = -mu ln P / sum G L of `areas`, with G
/// of the measured inclinations. `index` is the ratio of both sides, each summed over the cosines, which are midpoints
/// of [0.2, 1].
struct Clumping {
  std::vector<double> mu, gap_fraction, omega;
  double index = 1;
};
Clumping measure_clumping(const scene::Scene& scene, const CanopySurvey& survey, uint32_t rays_per_direction);

/// The same by slab: from how the logarithm of the gap fraction changes across it. Leaves under others are hidden from
/// above, which is not so from below. From .02 to 1; 1 where there is nothing.
struct ClumpingProfile {
  std::vector<double> above, below;  ///< for rays from the top, and from the ground
};
ClumpingProfile measure_clumping_profile(const scene::Scene& scene, const CanopySurvey& survey,
                                         uint32_t rays_per_direction);

}  // namespace dapple::vegetation
