// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

build::BuiltScene lamp(const std::string& parameters, const std::string& corner) {
  return test::build_text(R"(Camera "perspective"
WorldBegin
AreaLightSource "diffuse" )" +
                          parameters + R"(
Shape "trianglemesh" "point3 P" [ 0 0 0  2 0 0  2 1 0  )" +
                          corner + R"( 0 ] "integer indices" [ 0 1 2  2 3 0 ]
)");
}

TEST(AreaLights, TwoTrianglesOfARectangleAreOneLight) {
  const auto one = lamp(R"("rgb L" [ 1 1 1 ])", "0 1");
  ASSERT_EQ(one.scene->lights.size(), 1u);
  EXPECT_EQ(one.scene->emitter(0, 0), one.scene->lights[0].get());
  EXPECT_EQ(one.scene->emitter(0, 1), one.scene->lights[0].get());
  const auto two = lamp(R"("rgb L" [ 1 1 1 ])", "0 1.5");
  EXPECT_EQ(two.scene->lights.size(), 2u);
  EXPECT_NE(two.scene->emitter(0, 0), two.scene->emitter(0, 1));
}

// pbrt gives the power to each triangle.
TEST(AreaLights, PowerIsThatOfEachTriangle) {
  EXPECT_EQ(lamp(R"("float power" 10 "rgb L" [ 1 1 1 ])", "0 1").scene->lights.size(), 2u);
}

// A texture over u, v lies on each triangle by itself.
TEST(AreaLights, TextureLiesOnEachTriangle) {
  const auto built = test::build_text(R"(Camera "perspective"
WorldBegin
Texture "checks" "spectrum" "checkerboard" "rgb tex1" [ 3 3 3 ]
AreaLightSource "diffuse" "texture L" "checks"
Shape "trianglemesh" "point3 P" [ 0 0 0  2 0 0  2 1 0  0 1 0 ] "integer indices" [ 0 1 2  2 3 0 ]
)");
  EXPECT_EQ(built.scene->lights.size(), 2u);
}

}  // namespace
}  // namespace dapple
