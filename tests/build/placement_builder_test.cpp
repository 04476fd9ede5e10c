// SPDX-License-Identifier: Apache-2.0
// Objects in objects and placements from files, from text to what rays meet; and what is refused, with its place.
#include "dapple/build/placement_builder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "dapple/build/scene_builder.h"

namespace dapple::build {
namespace {

using scenefile::encode_placements;
using scenefile::ExactPlacement;

struct TemporaryFolder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("dapple_places_" + std::to_string(getpid()));
  TemporaryFolder() { std::filesystem::create_directories(path); }
  ~TemporaryFolder() { std::filesystem::remove_all(path); }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path / name, std::ios::binary) << bytes;
  }
  BuiltScene build(const std::string& world, Diagnostics& diagnostics) const {
    const auto description =
        scenefile::parse_pbrt("Camera \"perspective\" WorldBegin\n" + world, "test.pbrt", path.string(), diagnostics);
    return build_scene(description, {}, diagnostics);
  }
  BuiltScene build(const std::string& world) const {
    Diagnostics diagnostics;
    return build(world, diagnostics);
  }
  std::string error(const std::string& world) const {
    try {
      build(world);
    } catch (const InputError& problem) {
      return problem.what();
    }
    return "";
  }
};

ExactPlacement at(double x, double y, double z, double scale = 1) {
  return {scale, 0, 0, x, 0, scale, 0, y, 0, 0, scale, z};
}

const std::string ball = "ObjectBegin \"ball\" Shape \"sphere\" ObjectEnd\n";

/// Distance from high above (x, y) to what a ray down meets; negative: nothing.
float depth(const BuiltScene& built, double x, double y) {
  trace::RayBatch rays{};
  trace::HitBatch hits;
  rays.set(0, V3f(float(x - built.origin.x), float(y - built.origin.y), float(100 - built.origin.z)), V3f(0, 0, -1),
           infinity, 0, 1);
  built.scene->traced.intersect(rays, 1, &hits);
  return hits.geometry[0] == trace::no_id ? -1 : hits.t[0];
}

TEST(Placements, FromFilesStandWhereTheySay) {
  const TemporaryFolder folder;
  folder.write("three.places", encode_placements(std::vector{at(0, 0, 0), at(10, 0, 5), at(0, 10, 0, 3)}));
  const BuiltScene built =
      folder.build(ball + "Translate 1 2 3 ObjectInstances \"ball\" \"string filename\" \"three.places\"\n");
  EXPECT_EQ(built.scene->traced.instance_count(), 3u);
  EXPECT_EQ(built.scene->traced.single_count(), 3u);  // few are instances as others are
  EXPECT_FLOAT_EQ(depth(built, 1, 2), 96);
  EXPECT_FLOAT_EQ(depth(built, 11, 2), 91);
  EXPECT_FLOAT_EQ(depth(built, 1, 12), 94);
  EXPECT_LT(depth(built, 4, 2), 0);
}

TEST(Placements, InGreatNumbersStandBehindPortals) {
  const TemporaryFolder folder;
  std::vector<ExactPlacement> field;
  for (int i = 0; i < 140000; ++i) field.push_back(at(3 * (i % 400), 3 * (i / 400), 0));
  folder.write("field.places", encode_placements(field));
  const BuiltScene built = folder.build(ball + "ObjectInstances \"ball\" \"string filename\" \"field.places\"\n");
  EXPECT_EQ(built.scene->traced.instance_count(), 140000u);
  EXPECT_EQ(built.scene->traced.single_count(), 0u);
  EXPECT_FLOAT_EQ(depth(built, 300, 603), 99);
  EXPECT_LT(depth(built, 301.5, 604.5), 0);
}

// Far off, where floats have steps of half a metre; in objects too, whose own shapes may be far from their origins.
TEST(Placements, KeepTheirPlacesFarFromTheOrigin) {
  const TemporaryFolder folder;
  const double x = 5e6 + 0.25, y = -3e6 + 0.125;
  folder.write("far.places", encode_placements(std::vector{at(x, y, 0), at(x + 10, y, 0)}));
  folder.write("near.places", encode_placements(std::vector{at(0, 0, 0), at(0, 4, 0, .5)}));
  const BuiltScene built = folder.build(
      "ObjectBegin \"ball\" Translate 70000 0 0 Shape \"sphere\" ObjectEnd\n"
      "ObjectBegin \"two\" Translate -70000 0 0 ObjectInstances \"ball\" \"string filename\" \"near.places\" "
      "ObjectEnd\n"
      "ObjectInstances \"two\" \"string filename\" \"far.places\"\n");
  EXPECT_EQ(built.scene->traced.instance_count(), 6u);
  EXPECT_NEAR(depth(built, x, y), 99, 4e-3);  // of a scene 35 km wide
  EXPECT_NEAR(depth(built, x + 10.6, y), 99.2, 4e-3);
  EXPECT_NEAR(depth(built, x - 35000, y + 4), 99.5, 4e-3);
  EXPECT_LT(depth(built, x + 1.01, y), 0);
}

// Expectation: what is modelled far off and brought back is near, in the scene and in an object.
TEST(Placements, BringBackWhatLiesFarOff) {
  const TemporaryFolder folder;
  folder.write("back.places", encode_placements(std::vector{at(-7e6, 0, 0), at(-7e6, 5, 0)}));
  const std::string far = "ObjectBegin \"ball\" Translate 7e6 0 0 Shape \"sphere\" ObjectEnd\n",
                    place = "ObjectInstances \"ball\" \"string filename\" \"back.places\"\n";
  for (const std::string& world :
       {far + place, far + "ObjectBegin \"two\" " + place + "ObjectEnd ObjectInstance \"two\"\n"}) {
    const BuiltScene built = folder.build(world);
    EXPECT_EQ(built.origin, V3d(0));
    EXPECT_NEAR(depth(built, 0, 5), 99, 1e-4);
    EXPECT_NEAR(depth(built, 0.6, 0), 99.2, 1e-4);
  }
}

TEST(Placements, OfNoShapesAreNoMatter) {
  const TemporaryFolder folder;
  folder.write("none.places", encode_placements({}));
  const BuiltScene built =
      folder.build(ball +
                   "ObjectBegin \"empty\" ObjectEnd\nObjectBegin \"outer\" ObjectInstance "
                   "\"empty\" ObjectEnd\nObjectInstance \"outer\"\nObjectInstances \"ball\" \"string "
                   "filename\" \"none.places\"\n");
  EXPECT_LT(depth(built, 0, 0), 0);
}

TEST(Placements, InOnePlaceCountOnce) {
  const TemporaryFolder folder;
  folder.write("twice.places", encode_placements(std::vector{at(0, 0, 0), at(5, 0, 0), at(0, 0, 0)}));
  Diagnostics diagnostics;
  const BuiltScene built =
      folder.build(ball + "ObjectInstances \"ball\" \"string filename\" \"twice.places\"", diagnostics);
  EXPECT_EQ(built.scene->traced.instance_count(), 2u);
  ASSERT_EQ(diagnostics.messages().size(), 2u);  // and that there is no light
}

TEST(Placements, AreRefusedWithTheirPlace) {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& world, const std::string& place, const std::string& what) {
    const std::string message = folder.error(world);
    EXPECT_EQ(message.find("test.pbrt:" + place), 0u) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  // Recursion: by itself, by way of others, by files.
  expect("ObjectBegin \"a\"\nObjectInstance \"a\" ObjectEnd", "3:1", "holds itself");
  expect("ObjectBegin \"a\"\nObjectInstance \"b\" ObjectEnd\nObjectBegin \"b\"\nObjectInstance \"a\" ObjectEnd", "5:1",
         "holds itself");
  expect("ObjectBegin \"a\"\nObjectInstances \"a\" \"string filename\" \"x\" ObjectEnd", "3:1", "holds itself");
  // Five levels.
  const std::string deep =
      ball +
      "ObjectBegin \"b\"\nObjectInstance \"ball\" ObjectEnd\nObjectBegin \"c\"\nObjectInstance \"b\" "
      "ObjectEnd\nObjectBegin \"d\"\nObjectInstance \"c\" ObjectEnd\n";
  EXPECT_EQ(folder.error(deep + "ObjectInstance \"d\""), "");
  expect(deep + "ObjectBegin \"e\"\nObjectInstance \"d\" ObjectEnd", "10:1", "deep");
  expect("ObjectInstances \"nobody\" \"string filename\" \"x\"", "2:1", "not defined");
  // Motion.
  const std::string moving = "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All\n";
  expect(ball + "ObjectBegin \"b\"\n" + moving + "ObjectInstance \"ball\" ObjectEnd", "5:1", "moves");
  expect(ball + "ObjectBegin \"b\"\nObjectInstance \"ball\" ObjectEnd\n" + moving + "ObjectInstance \"b\"", "6:1",
         "moves");
  expect(
      "ObjectBegin \"a\"\n" + moving + "Shape \"sphere\"\nObjectEnd\nObjectBegin \"b\"\nObjectInstance \"a\" ObjectEnd",
      "7:1", "test.pbrt:4:1");
  expect(ball + moving + "ObjectInstances \"ball\" \"string filename\" \"x\"", "4:1", "moves");
  // Maps without inverse.
  expect(ball + "ObjectBegin \"b\"\nScale 1e-12 1 1 ObjectInstance \"ball\" ObjectEnd", "4:", "too small");
  folder.write("flat.places", encode_placements(std::vector{at(0, 0, 0), at(1, 2, 3, 0)}));
  expect(ball + "ObjectInstances \"ball\" \"string filename\" \"flat.places\"", "3:1", "placement 2");
  std::string no_number = encode_placements(std::vector{at(1, 2, 3)});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(no_number.data() + no_number.size() - 4, &nan, 4);
  folder.write("nan.places", no_number);
  expect(ball + "ObjectInstances \"ball\" \"string filename\" \"nan.places\"", "3:1", "placement 1");
  // Files.
  expect(ball + "ObjectInstances \"ball\" \"string filename\" \"not-there.places\"", "3:1", "not-there.places");
  folder.write("cut.places", no_number.substr(0, 70));
  expect(ball + "ObjectInstances \"ball\" \"string filename\" \"cut.places\"", "3:1", "byte");
  expect(ball + "ObjectInstances \"ball\"", "3:1", "filename");
  // More ways than 32 bits name: 300 each on four levels.
  std::vector<ExactPlacement> row;
  for (int i = 0; i < 300; ++i) row.push_back(at(3 * i, 0, 0));
  folder.write("row.places", encode_placements(row));
  const auto in = [](const std::string& inner) {
    return "ObjectInstances \"" + inner + "\" \"string filename\" \"row.places\"\n";
  };
  expect(ball + "ObjectBegin \"b\"\n" + in("ball") + "ObjectEnd\nObjectBegin \"c\"\n" + in("b") +
             "ObjectEnd\nObjectBegin \"d\"\n" + in("c") + "ObjectEnd\n" + in("d"),
         "12:1", "ways");
}

// Rationale: 65,535 objects of 65,535 places are just as many ways as there may be. Expectation: three more, which are
// to become Embree's own instances, are refused with their place, and not when all is built.
TEST(Placements, CountThoseThatBecomeInstances) {
  const TemporaryFolder folder;
  std::vector<ExactPlacement> row;
  for (int i = 0; i < 65535; ++i) row.push_back(at(3 * i, 0, 0));
  folder.write("row.places", encode_placements(row));
  folder.write("three.places", encode_placements(std::vector{at(0, 9, 0), at(0, 19, 0), at(0, 29, 0)}));
  const std::string message =
      folder.error(ball +
                   "ObjectBegin \"b\" ObjectInstances \"ball\" \"string filename\" \"row.places\" ObjectEnd\n"
                   "ObjectInstances \"ball\" \"string filename\" \"three.places\"\n"
                   "ObjectInstances \"b\" \"string filename\" \"row.places\"\n");
  EXPECT_EQ(message.find("test.pbrt:5:1"), 0u) << message;
  EXPECT_NE(message.find("4294901760 ways"), std::string::npos) << message;
}

TEST(Placements, SayThatEmittersDoNotShine) {
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  folder.build(
      "ObjectBegin \"lamp\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd\nObjectBegin \"b\" "
      "ObjectInstance \"lamp\" ObjectEnd ObjectInstance \"b\"",
      diagnostics);
  ASSERT_EQ(diagnostics.unsupported_features().size(), 1u);
  EXPECT_EQ(diagnostics.unsupported_features()[0].find("an area light that is instanced"), 0u);
}

}  // namespace
}  // namespace dapple::build
