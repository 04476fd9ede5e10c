// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/ground_visibility.h"
#include "dapple/scene/scene.h"

namespace dapple::vegetation {

struct GroundSurveyOptions {
  float nearest = 0;  ///< m from the camera: the ground beyond is looked at
  float pixel = 0;  ///< m; 0: as lets 3072 x 3072 hold all that is shaded, but from 1 to 8 times as wide as the film's
                    ///< pixels at `nearest`
};

/// What of sun and sky arrives on the ground of a scene (z up), by rays and Fourier transforms (forest/penumbra.h). The
/// ground is what is met first from below, where something stands on it or near, on at most 4096 x 4096 pixels about
/// the camera. Canopies become one sheet for each light, at the mean height at which they are met: for suns what stands
/// along the middle of the beam, which puts shadows where they belong; for the sky what stands above. Suns lower than 6
/// degrees, those wider than 11, and those whose shadows are 4096 pixels long are left out. The sky is that of all
/// lights at infinity, on 128 x 64 directions, from the middle of the plot. No pixels where nothing stands on any
/// ground.
forest::GroundLight survey_ground(const scene::Scene& scene, const GroundSurveyOptions& options);

}  // namespace dapple::vegetation
