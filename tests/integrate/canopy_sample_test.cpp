// SPDX-License-Identifier: Apache-2.0
// Surveys of more facets than are counted one by one.
#include "dapple/vegetation/canopy_sample.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "dapple/build/scene_builder.h"
#include "dapple/scenefile/placement_file.h"
#include "dapple/vegetation/canopy_numbers.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

constexpr int leaves = 20000, trees = 2500;
constexpr float leaf_side = 0.02f;

/// A cloud of square leaves of two facets, and so many of it; scale: of tree i.
template <typename Scale>
std::string forest(const Scale& scale) {
  std::string points, indices,
      text =
          "Camera \"perspective\" WorldBegin\nLightSource \"infinite\"\n"
          "ObjectBegin \"tree\"\nMaterial \"diffusetransmission\"\n";
  KeyedRng rng(3);
  for (int i = 0; i < leaves; ++i) {
    const V3f c(rng.next(), rng.next(), 1 + 2 * rng.next());
    for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
      points += std::to_string(c.x + leaf_side * float(u)) + " " + std::to_string(c.y + leaf_side * float(v)) + " " +
                std::to_string(c.z) + " ";
    for (const int k : {0, 1, 2, 0, 2, 3}) indices += std::to_string(4 * i + k) + " ";
  }
  text += "Shape \"trianglemesh\" \"point3 P\" [ " + points + "] \"integer indices\" [ " + indices + "]\nObjectEnd\n";
  for (int i = 0; i < trees; ++i) {
    const std::string s = std::to_string(scale(i));
    text += "AttributeBegin Translate " + std::to_string(2 * (i % 50)) + " " + std::to_string(2 * (i / 50)) +
            " 0 Scale " + s + " " + s + " " + s + " ObjectInstance \"tree\" AttributeEnd\n";
  }
  return text;
}

double sampled_area(const std::string& text) {
  const build::BuiltScene built = test::build_text(text);
  const vegetation::CanopySurvey survey = vegetation::sample_canopy(
      *built.scene, vegetation::optics_of_geometries(*built.scene), {Box2f(V2f(-1), V2f(102)), 10, 9, {}});
  double area = 0;
  for (const auto& kind : survey.kinds) area += kind.area_m2;
  return area;
}

// Rationale: some instances count for all. Expectation: of equal trees the area of all (float sums); of trees whose
// area differs by a standard deviation of d of its mean, within five of d sqrt((1/n - 1/N)), of n that are drawn of N.
TEST(CanopySample, SomeTreesCountForAll) {
  static_assert(2.0 * leaves * trees > 2.9 * double(vegetation::CanopyNumbers::most_facets));
  const double one = double(leaves) * double(leaf_side) * double(leaf_side);
  EXPECT_NEAR(sampled_area(forest([](int) { return 1.0f; })), trees * one, 1e-3 * trees * one);
  double sum = 0, squares = 0;
  const auto scale = [](int i) { return 0.7f + 0.6f * KeyedRng(hash(uint32_t(i), 7u)).next(); };
  for (int i = 0; i < trees; ++i) {
    const double area = one * double(scale(i)) * double(scale(i));
    sum += area, squares += area * area;
  }
  const double mean = sum / trees, d = std::sqrt(squares / trees - mean * mean) / mean;
  const double drawn = double(vegetation::CanopyNumbers::most_facets) / (2.0 * leaves);
  EXPECT_NEAR(sampled_area(forest(scale)) / sum, 1, 5 * d * std::sqrt(1 / drawn - 1.0 / trees));
}

// Rationale: one leaf of 4 square metres among 4.4 million paths to small ones. Expectation: the areas of both, the
// large one's exactly, since what is placed seldom is never left to chance.
TEST(CanopySample, CountsWhatIsPlacedOnceAmongMillions) {
  constexpr int many = 2100;
  const auto folder = std::filesystem::temp_directory_path() / ("dapple_canopy_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::vector<scenefile::ExactPlacement> places;
  for (int i = 0; i < many; ++i)
    places.push_back({1, 0, 0, double(i % 70) / 70, 0, 1, 0, double(i / 70) / 30, 0, 0, 1, 1 + double(i) / many});
  std::ofstream(folder / "many.places", std::ios::binary) << scenefile::encode_placements(places);
  const std::string square =
      "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  1 1 0  0 1 0 ] \"integer indices\" [ 0 1 2 0 2 3 ]";
  const std::string text =
      "Camera \"perspective\" WorldBegin\nLightSource \"infinite\"\nMaterial \"diffusetransmission\"\n"
      "ObjectBegin \"leaf\" Scale .01 .01 .01 " +
      square +
      " ObjectEnd\n"
      "ObjectBegin \"tree\" ObjectInstances \"leaf\" \"string filename\" \"many.places\" ObjectEnd\n"
      "Material \"diffusetransmission\" \"rgb reflectance\" [ .1 .1 .1 ]\n"
      "ObjectBegin \"roof\" Scale 2 2 2 " +
      square +
      " ObjectEnd\n"
      "ObjectBegin \"house\" Translate 0 0 2 ObjectInstance \"roof\" ObjectEnd\n"
      "ObjectInstance \"house\"\nObjectInstances \"tree\" \"string filename\" \"many.places\"\n";
  Diagnostics diagnostics;
  const build::BuiltScene built =
      build::build_scene(scenefile::parse_pbrt(text, "test.pbrt", folder.string(), diagnostics), {}, diagnostics);
  std::filesystem::remove_all(folder);
  ASSERT_GT(built.scene->traced.instance_count(), vegetation::CanopyNumbers::most_placed);
  const vegetation::CanopySurvey survey = vegetation::sample_canopy(
      *built.scene, vegetation::optics_of_geometries(*built.scene), {Box2f(V2f(-1), V2f(4)), 4, 9, {}});
  ASSERT_EQ(survey.kinds.size(), 2u);
  std::vector<double> areas{survey.kinds[0].area_m2, survey.kinds[1].area_m2};
  std::sort(areas.begin(), areas.end());
  EXPECT_NEAR(areas[0], 4, 1e-5);
  EXPECT_NEAR(areas[1], many * many * 1e-4, 1e-3 * many * many * 1e-4);
}

}  // namespace
}  // namespace dapple
