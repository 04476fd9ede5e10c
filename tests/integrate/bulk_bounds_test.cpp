// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/bulk_bounds.h"

#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple::trace {
namespace {

std::string quad(float x, float y, float z, float size) {
  const auto corner = [&](float u, float v) {
    return std::to_string(x + u * size) + " " + std::to_string(y + v * size) + " " + std::to_string(z) + " ";
  };
  return "Shape \"bilinearmesh\" \"point3 P\" [ " + corner(-.5f, -.5f) + corner(.5f, -.5f) + corner(-.5f, .5f) +
         corner(.5f, .5f) + "]\n";
}

// A table of many tiles, in places of an object, on a ground of one quad that is a thousand times as wide.
TEST(BulkBounds, LeaveGroundsOut) {
  std::string text = "Camera \"perspective\"\nWorldBegin\nObjectBegin \"row\"\n";
  for (int i = 0; i < 20; ++i) text += quad(float(i), 0, 0, 1);
  text += "ObjectEnd\n" + quad(5000, 5000, -1, 20000);
  for (int j = 0; j < 20; ++j)
    text += "AttributeBegin\nTranslate 0 " + std::to_string(j) + " 0\nObjectInstance \"row\"\nAttributeEnd\n";
  const auto built = test::build_text(text);
  const Box3f box = bulk_bounds(built.scene->traced);
  EXPECT_NEAR(box.min.x, 1, 1);
  EXPECT_NEAR(box.max.x, 18, 1);
  EXPECT_NEAR(box.min.y, 1, 1);
  EXPECT_NEAR(box.max.y, 18, 1);
  EXPECT_EQ(box.min.z, 0);
  EXPECT_EQ(box.max.z, 0);
}

TEST(BulkBounds, TakeEveryKindOfShape) {
  const auto built = test::build_text(R"(Camera "perspective"
WorldBegin
AttributeBegin
Translate 0 0 4
Shape "sphere" "float radius" 2
AttributeEnd
Shape "curve" "point3 P" [ 9 0 0  9 0 1  9 0 2  9 0 3 ] "float width" .1
Shape "bilinearmesh" "point3 P" [ -9 0 0  -7 0 0  -9 2 0  -7 2 0 ]
)");
  const Box3f box = bulk_bounds(built.scene->traced);
  EXPECT_NEAR(box.max.x, 9, 1e-4);
  EXPECT_NEAR(box.min.x, -9 + 2 / 3.0, 1e-4);
  EXPECT_NEAR(box.max.z, 4, 1e-4);
}

TEST(BulkBounds, AreEmptyWhereThereIsNothing) {
  EXPECT_TRUE(bulk_bounds(test::build_text("Camera \"perspective\"\nWorldBegin\n").scene->traced).isEmpty());
}

}  // namespace
}  // namespace dapple::trace
