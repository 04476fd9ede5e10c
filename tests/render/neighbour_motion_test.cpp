// SPDX-License-Identifier: Apache-2.0
// Motion to the scenes of neighbouring frames, against closed forms: a pinhole's f x / z there and here.
#include <gtest/gtest.h>

#include "dapple/render/frame_denoiser.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

// 20 x 20 pixels, 90 degrees: focal length 10 pixels. From z = 5 downwards; +x of the world is to the left, +y up.
std::string head(const std::string& place = "LookAt 0 0 5  0 0 0  0 1 0") {
  return place +
         "\nCamera \"perspective\" \"float fov\" 90 \"float shutterclose\" 1\n"
         "Film \"rgb\" \"integer xresolution\" 20 \"integer yresolution\" 20\nPixelFilter \"box\"\nWorldBegin\n";
}
const std::string floor_ = "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]\n";
const std::string ball = "Shape \"sphere\" \"float radius\" .01\n";

std::string at(const std::string& transform, const std::string& what) {
  return "AttributeBegin\n" + transform + "\n" + what + "AttributeEnd\n";
}
std::string moving(const std::string& end, const std::string& what) {
  return at("ActiveTransform EndTime\n" + end + "\nActiveTransform All", what);
}

struct Found {
  image::Image motion;
  size_t lost_shapes, lost_instances;
};

Found motion_to(const std::string& here, const std::string& there, int frames = 1) {
  const build::BuiltScene a = test::build_text(here), b = test::build_text(there);
  const integrate::NeighbourScene to{*b.scene, frames, a.origin - b.origin, {a.scene->traced, b.scene->traced}};
  return {render::trace_motion(*a.scene, a.scene->film.crop, {4, 0, 4}, {}, &to), to.same.lost_shapes(),
          to.same.lost_instances()};
}

void expect_everywhere(const Found& found, const V3f& expected, float tolerance = 1e-4f) {
  for (int y = 0; y < found.motion.height(); ++y)
    for (int x = 0; x < found.motion.width(); ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(found.motion.pixel(x, y)[c], expected[c], tolerance) << x << ", " << y << ", channel " << c;
}

// 10 pixels / 5 m; what the shutter says does not count.
TEST(NeighbourMotion, IsThatOfShapesBetweenTheScenes) {
  const std::string here = head() + moving("Translate 3 0 0", floor_);
  for (const int frames : {1, -1}) {
    const Found found = motion_to(here, head() + at("Translate .5 .25 0", floor_), frames);
    EXPECT_EQ(found.lost_shapes, 0u);
    expect_everywhere(found, V3f(-1, -.5f, 0));
  }
}

// By a quarter of a turn (x, y) comes to (-y, x), right or left: no linear motion does that.
TEST(NeighbourMotion, IsExactForTurns) {
  const Found found = motion_to(head() + floor_, head() + at("Rotate 90 0 0 1", floor_));
  for (const V2i& p : {V2i(0, 0), V2i(5, 12), V2i(19, 3)}) {
    const V2f place(float(p.x) + .5f - 10, float(p.y) + .5f - 10);
    // Of the pixel's samples the mean is within it.
    EXPECT_NEAR(found.motion.pixel(p.x, p.y)[0], -place.y - place.x, 1) << p.x;
    EXPECT_NEAR(found.motion.pixel(p.x, p.y)[1], place.x - place.y, 1) << p.x;
  }
}

TEST(NeighbourMotion, IsThatOfVertices) {
  const auto mesh = [](const char* points) {
    return "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ " + std::string(points) + " ]\n";
  };
  expect_everywhere(
      motion_to(head() + mesh("-90 -90 0  90 -90 0  0 190 0"), head() + mesh("-89 -91 0  91 -91 0  1 189 0")),
      V3f(-2, 2, 0));
}

TEST(NeighbourMotion, IsThatOfInstances) {
  const auto placed = [](const char* where) {
    return "ObjectBegin \"floor\"\n" + floor_ + "ObjectEnd\n" + at(where, "ObjectInstance \"floor\"\n");
  };
  const Found found = motion_to(head() + placed("Translate 0 0 0"), head() + placed("Translate -.5 0 0"));
  EXPECT_EQ(found.lost_instances, 0u);
  expect_everywhere(found, V3f(1, 0, 0));
}

// And of what stays beside it: the neighbour's camera sees it.
TEST(NeighbourMotion, IsThatOfTheCamera) {
  expect_everywhere(motion_to(head() + floor_, head("LookAt 0 1 5  0 1 0  0 1 0") + floor_), V3f(0, 2, 0));
  expect_everywhere(motion_to(head() + floor_, head("LookAt 0 0 6  0 0 0  0 1 0") + at("Translate 0 0 1", floor_)),
                    V3f(0, 0, 0));
}

// Of objects of one kind the first is placed once more in one of the scenes: the others stay what they are.
TEST(NeighbourMotion, ObjectsStayThemselvesWhenOthersArePlacedAgain) {
  const auto object = [](const std::string& name, const std::string& size) {
    return "ObjectBegin \"" + name + "\"\nShape \"bilinearmesh\" \"point3 P\" [ -" + size + " -" + size + " 0  " +
           size + " -" + size + " 0  -" + size + " " + size + " 0  " + size + " " + size + " 0 ]\nObjectEnd\n";
  };
  const auto place = [](const char* z, const std::string& name) {
    return at(std::string("Translate 0 0 ") + z, "ObjectInstance \"" + name + "\"\n");
  };
  const std::string once = head() + object("a", "99") + object("b", "2") + place("-20", "a") + place("0", "b") +
                           place("-5", "b"),
                    twice = once + place("-30", "a");
  for (const bool comes : {true, false}) {
    const Found found = comes ? motion_to(once, twice) : motion_to(twice, once);
    EXPECT_EQ(found.lost_shapes, 0u);
    EXPECT_EQ(found.lost_instances, comes ? 0u : 1u);
    expect_everywhere(found, V3f(0, 0, 0));
  }
  // Another definition before them, in which their numbers change.
  const std::string more = head() + object("c", "1") + object("a", "99") + object("b", "2") + place("50", "c") +
                           place("51", "c") + place("-20", "a") + place("0", "b") + place("-5", "b");
  const Found found = motion_to(once, more);
  EXPECT_EQ(found.lost_shapes + found.lost_instances, 0u);
  expect_everywhere(found, V3f(0, 0, 0));
}

// Two walls of one object, in another order in the next frame; each moves by itself.
TEST(NeighbourMotion, FollowsNamesOfInstances) {
  const std::string wall = "ObjectBegin \"wall\"\n" + floor_ + "ObjectEnd\n";
  const auto place = [](const char* where, const char* name) {
    return at(std::string("Translate ") + where,
              "ObjectInstance \"wall\" \"string name\" \"" + std::string(name) + "\"\n");
  };
  const std::string here = head() + wall + place("0 0 0", "near") + place("0 0 -40", "far"),
                    there = head() + wall + place("0 0 -40", "far") + place(".5 0 0", "near");
  const Found found = motion_to(here, there);
  EXPECT_EQ(found.lost_instances, 0u);
  expect_everywhere(found, V3f(-1, 0, 0));
  // Which of the two goes is known as well; what is new has another name.
  const Found goes = motion_to(here, head() + wall + place("0 0 -30", "new") + place(".5 0 0", "near"));
  EXPECT_EQ(goes.lost_instances, 1u);
  expect_everywhere(goes, V3f(-1, 0, 0));
}

// Things that share a name correspond in their order, or where they are equal if one more has it.
TEST(NeighbourMotion, FollowsNamesThatAreShared) {
  const std::string wall = "ObjectBegin \"wall\"\n" + floor_ + "ObjectEnd\n";
  const auto place = [](const char* where, const char* name) {
    return at(std::string("Translate ") + where,
              "ObjectInstance \"wall\" \"string name\" \"" + std::string(name) + "\"\n");
  };
  const std::string here = head() + wall + place("0 0 0", "pane") + place("0 0 -40", "pane") + place("0 0 -50", "back");
  const Found moved =
      motion_to(here, head() + wall + place("0 0 -50", "back") + place(".5 0 0", "pane") + place("0 0 -40", "pane"));
  EXPECT_EQ(moved.lost_instances, 0u);
  expect_everywhere(moved, V3f(-1, 0, 0));
  const Found more = motion_to(here, head() + wall + place("0 0 -30", "pane") + place("0 0 0", "pane") +
                                         place("0 0 -41", "pane") + place("0 0 -50", "back"));
  EXPECT_EQ(more.lost_instances, 1u);
  expect_everywhere(more, V3f(0, 0, 0));
}

// Exporters number definitions: one more before them takes their names. Placed once or more often.
TEST(NeighbourMotion, NamesOfObjectsThatAreNotAlikeDoNotCount) {
  const std::string triangle =
      "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -90 -90 0  90 -90 0  0 190 0 ]\n";
  const auto object = [](const char* name, const std::string& shape) {
    return "ObjectBegin \"" + std::string(name) + "\"\n" + shape + "ObjectEnd\n";
  };
  const auto place = [](const char* where, const char* name) {
    return at(std::string("Translate ") + where, "ObjectInstance \"" + std::string(name) + "\"\n");
  };
  for (const bool once : {true, false}) {
    const auto twice = [&](const char* where, const char* name) {
      return place(where, name) + (once ? "" : place("0 0 60", name));
    };
    const std::string here = head() + object("0", floor_) + object("1", triangle) + twice("0 0 -40", "0") +
                             twice("0 0 0", "1"),
                      there = head() + object("0", ball) + object("1", floor_) + object("2", triangle) +
                              twice("0 0 70", "0") + twice("0 0 -40", "1") + twice(".5 0 0", "2");
    const Found found = motion_to(here, there);
    EXPECT_EQ(found.lost_shapes, 0u) << once;
    EXPECT_EQ(found.lost_instances, 0u) << once;
    expect_everywhere(found, V3f(-1, 0, 0));
  }
}

// An object that gets another part is the same object.
TEST(NeighbourMotion, NamesOfObjectsHoldWhenAPartIsAdded) {
  const auto scene = [](const char* where, const std::string& more) {
    return head() + "ObjectBegin \"a\"\n" + floor_ + more + "ObjectEnd\n" +
           at(std::string("Translate ") + where, "ObjectInstance \"a\"\n") +
           at("Translate 0 0 60", "ObjectInstance \"a\"\n");
  };
  const Found found = motion_to(scene("0 0 0", ""), scene(".5 0 0", at("Translate 0 0 -1", ball)));
  EXPECT_EQ(found.lost_shapes + found.lost_instances, 0u);
  expect_everywhere(found, V3f(-1, 0, 0));
}

TEST(NeighbourMotion, FollowsNamesOfShapes) {
  const auto named = [](const char* name, const char* points) {
    return "Shape \"trianglemesh\" \"string name\" \"" + std::string(name) +
           "\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ " + points + " ]\n";
  };
  const char *far = "-90 -90 -40  90 -90 -40  0 190 -40", *near = "-90 -90 0  90 -90 0  0 190 0",
             *moved = "-89.5 -90 0  90.5 -90 0  .5 190 0";
  const Found found =
      motion_to(head() + named("far", far) + named("near", near), head() + named("near", moved) + named("far", far));
  EXPECT_EQ(found.lost_shapes, 0u);
  expect_everywhere(found, V3f(-1, 0, 0));
}

// Objects that are placed once, deform, and change their order; one of them moves while the shutter is open, in one of
// the frames.
TEST(NeighbourMotion, FollowsNamesOfObjects) {
  const auto object = [](const std::string& name, const std::string& transform, const std::string& wide) {
    return "ObjectBegin \"" + name + "\"\n" +
           at(transform, "Shape \"bilinearmesh\" \"point3 P\" [ -" + wide + " -90 0  " + wide + " -90 0  -" + wide +
                             " 90 0  " + wide + " 90 0 ]\n") +
           "ObjectEnd\n";
  };
  const auto place = [](const char* where, const char* name) {
    return at(std::string("Translate ") + where, "ObjectInstance \"" + std::string(name) + "\"\n");
  };
  const std::string still = "", moving_then = "ActiveTransform EndTime Translate 3 0 0 ActiveTransform All";
  const std::string here =
      head() + object("a", still, "90") + object("b", still, "91") + place("0 0 0", "a") + place("0 0 -40", "b");
  for (const std::string& transform : {still, moving_then}) {
    const Found found = motion_to(here, head() + object("b", still, "92") + object("a", transform, "90") +
                                            place("0 0 -40", "b") + place(".5 0 0", "a"));
    EXPECT_EQ(found.lost_shapes, 0u);
    expect_everywhere(found, V3f(-1, 0, 0));
  }
}

// Scenes far from their origin are built around origins of their own.
TEST(NeighbourMotion, KnowsOriginsOfScenes) {
  const std::string far = "LookAt 1000000 0 5  1000000 0 0  0 1 0", farther = "LookAt 2000000 0 5  2000000 0 0  0 1 0";
  const Found found =
      motion_to(head(far) + at("Translate 1000000 0 0", floor_), head(farther) + at("Translate 2000000.5 0 0", floor_));
  expect_everywhere(found, V3f(-1, 0, 0), 1e-2f);
}

// What moves while the shutter is open is placed by a map of its own, what rests is not: they correspond in the order
// of the file all the same.
TEST(NeighbourMotion, FindsWhatBeginsToMove) {
  const std::string far = "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 -9  9 -9 -9  -9 9 -9  9 9 -9 ]\n";
  const std::string resting = head() + at("Translate 0 0 -1", far) + floor_ + at("Translate 0 0 -2", far),
                    moving_then = head() + at("Translate 0 0 -1", far) +
                                  at("Translate .5 0 0", moving("Translate 1 0 0", floor_)) +
                                  at("Translate 0 0 -2", far);
  const Found begins = motion_to(resting, moving_then), ends = motion_to(moving_then, resting);
  EXPECT_EQ(begins.lost_shapes + ends.lost_shapes, 0u);
  expect_everywhere(begins, V3f(-1, 0, 0));
  expect_everywhere(ends, V3f(1, 0, 0));
}

// A ball comes: what is equal is found again, in whatever order; what is not goes on as while the shutter is open.
TEST(NeighbourMotion, FallsBackWhereNothingCorresponds) {
  const std::string balls = at("Translate 0 0 40", ball);
  const Found same = motion_to(head() + balls + floor_, head() + balls + at("Translate 0 0 41", ball) + floor_);
  EXPECT_EQ(same.lost_shapes, 0u);
  expect_everywhere(same, V3f(0, 0, 0));

  const std::string quad = "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 50  9 -9 50  -9 9 50  9 9 50 ]\n";
  const std::string here = head() + moving("Translate .5 0 0", floor_), there = quad + at("Translate .25 0 0", floor_);
  const Found forwards = motion_to(here, head() + there), backwards = motion_to(here, head() + there, -1);
  EXPECT_EQ(forwards.lost_shapes, 1u);
  expect_everywhere(forwards, V3f(-1, 0, 0));
  expect_everywhere(backwards, V3f(1, 0, 0));
  // Seen by the neighbour's camera.
  expect_everywhere(motion_to(here, head("LookAt 0 1 5  0 1 0  0 1 0") + there), V3f(-1, 2, 0));
}

}  // namespace
}  // namespace dapple
