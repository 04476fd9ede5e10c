// SPDX-License-Identifier: Apache-2.0
// What integrators find out before rendering and owe to no light.
#include <gtest/gtest.h>

#include "dapple/build/integrator_factory.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using test::build_text;
using test::furnished_room;
using test::render_built;
using test::same_bits;

const std::string varnished = R"(Material "coateddiffuse" "rgb reflectance" [ .3 .5 .2 ] "float roughness" 0.1)";

// Readers, and places that want light, of one scene serve the same scene with other lights: The picture is
// the same, bit for bit, and other preparations change it.
TEST(Preparations, HoldForOtherLights) {
  const auto lit = [](const std::string& lights) { return build_text(furnished_room(varnished) + lights); };
  const auto before = lit("LightSource \"infinite\""), after = lit(R"(
LightSource "point" "rgb I" [ 3 1 1 ] "point3 from" [ .5 .8 .5 ]
LightSource "infinite" "rgb L" [ .2 .4 .8 ]
)");
  for (const char* type : {"distribution", "path"}) {
    build::IntegratorRequest r;
    r.type = type, r.bounces = 2;
    if (r.type == "distribution") r.radiosity_cache = true;
    const auto picture = [&](build::Preparations* known) {
      return render_built(after, 4, *build::make_integrator(*after.scene, r, 4, 0, {}, known)).film;
    };
    build::Preparations known;
    build::make_integrator(*before.scene, r, 4, 0, {}, &known);
    EXPECT_EQ(known.readers != nullptr, r.type == "distribution");
    ASSERT_TRUE(known.light_points);
    const build::Preparations found = known;
    const scene::Film fresh = picture(nullptr);
    EXPECT_TRUE(same_bits(picture(&known), fresh)) << type;
    EXPECT_EQ(known.readers, found.readers);
    EXPECT_EQ(known.light_points, found.light_points);
    build::Preparations wrong = known;
    wrong.light_points = std::make_shared<const std::vector<light::LightPoint>>(1, known.light_points->front());
    EXPECT_FALSE(same_bits(picture(&wrong), fresh)) << type;
    if (r.type != "distribution") continue;
    wrong = known;
    wrong.readers = std::make_shared<const distribution::SurveyedReaders>();
    EXPECT_FALSE(same_bits(picture(&wrong), fresh));
  }
}

}  // namespace
}  // namespace dapple
