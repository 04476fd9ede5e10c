// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/vegetation/canopy_survey.h"

namespace dapple::vegetation {

/// survey_canopy() in bounded time: where instances have more than SurveyEffort::facets facets over the plot,
/// some of each object, drawn at random, are counted for all. Of equal trees the same, but for those that the plot's
/// border cuts; of others an estimate without bias, within a hundredth for some hundred trees.
CanopySurvey sample_canopy(const scene::Scene& scene, const std::vector<SurfaceOptics>& optics,
                           const CanopySurveyOptions& options);

}  // namespace dapple::vegetation
