// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/forest/leaf_survey.h"
#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// Means over the area of a geometry that is not cut out, by channel.
struct SurfaceOptics {
  std::array<double, 3> reflectance{}, transmittance{};  ///< of specular kinds: Bsdf::albedo(), all of it reflected
  double opaque = 1;  ///< part of the area that is not cut out
};
/// Exact where the material is the same everywhere; else from 4096 points spread over the area.
SurfaceOptics mean_optics(const scene::Scene& scene, uint32_t geometry);

bool is_disk(const trace::Shape& shape);

/// Adds the polygons of a geometry, placed by an instance (no_id: as it is), to a survey; quadrics as facets of the right total
/// area, disks as disks. Curves are left out.
void add_facets(const trace::TracedScene& traced, uint32_t geometry, uint32_t instance, int kind, double share, forest::LeafSurvey* out);

}  // namespace dapple::integrate
