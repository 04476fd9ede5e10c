// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/ambient_occlusion.h"

#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

// Between wide parallel planes a height h = 1 apart a ray of cosine c meets the other after h / c. With reach D those
// of c < h / D are open: a share of (h / D)^2, cosine-weighted.
RGB between_planes(const path::AmbientOcclusion::Settings& settings) {
  const auto built = test::build_text(R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -1 1 -1 1 ]
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .25 .8 ]
Shape "bilinearmesh" "point3 P" [ -99 -99 0  99 -99 0  -99 99 0  99 99 0 ]
Material "diffuse" "rgb reflectance" [ .6 .4 .2 ]
Shape "bilinearmesh" "point3 P" [ -99 -99 1  99 -99 1  -99 99 1  99 99 1 ]
)");
  return test::render_built(built, 16, path::AmbientOcclusion(*built.scene, settings)).mean();
}

TEST(AmbientOcclusion, BetweenPlanesIsTheSquareOfHeightOverReach) {
  for (const float reach : {1.25f, 2.0f, 4.0f}) {
    const RGB open = between_planes({8, reach, false, 1});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(open[c], 1 / (reach * reach), 0.01f) << reach;
  }
  EXPECT_EQ(between_planes({8, 0.9f, false, 1}), RGB(1));
}

TEST(AmbientOcclusion, ColoursBleed) {
  const float open = 1 / 4.0f;
  const RGB seen = between_planes({8, 2, true, 1}), own(.5f, .25f, .8f), other(.6f, .4f, .2f);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen[c], own[c] * (open + (1 - open) * 0.5f * other[c]), 0.01f);
}

}  // namespace
}  // namespace dapple
