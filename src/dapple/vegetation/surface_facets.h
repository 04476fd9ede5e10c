// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>

#include "dapple/forest/leaf_survey.h"
#include "dapple/scene/scene.h"

namespace dapple::vegetation {

/// Means over the area of a geometry that is not cut out, by channel.
struct SurfaceOptics {
  std::array<double, 3> reflectance{}, transmittance{};  ///< of specular kinds: Bsdf::albedo(), all of it reflected
  double opaque = 1;                                     ///< part of the area that is not cut out

  bool transmits() const { return transmittance[0] + transmittance[1] + transmittance[2] > 0; }
};
/// Exact where the material is the same everywhere; else from 4096 points spread over the area.
SurfaceOptics mean_optics(const scene::Scene& scene, uint32_t geometry);

bool is_disk(const trace::Shape& shape);

/// Visits the faces of a mesh, the quads of grids and facets of a quadric, in the shape's own space, in the middle of
/// the shutter: 3 or 4 corners going round, with the parameters that textures of its alpha are asked for there.
using FacetVisitor = std::function<void(const V3f* corners, const V2f* uv, int corner_count, uint32_t primitive)>;
void for_each_facet(const trace::Shape& shape, const FacetVisitor& visit);

/// Adds the polygons of a geometry, placed by an instance (no_id: as it is), to a survey; quadrics as facets of the
/// right total area, disks as disks. Curves are left out.
void add_facets(const trace::TracedScene& traced, uint32_t geometry, uint32_t instance, int kind, double share,
                forest::LeafSurvey* out);

}  // namespace dapple::vegetation
