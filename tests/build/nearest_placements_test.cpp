// SPDX-License-Identifier: Apache-2.0
// Places of objects that say how finely they are diced, against all places.
#include "dapple/build/nearest_placements.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "dapple/base/hash.h"
#include "dapple/build/scene_builder.h"
#include "dapple/image/texture_system.h"
#include "dapple/scenefile/placement_file.h"

namespace dapple::build {
namespace {

using scenefile::encode_placements;
using scenefile::ExactPlacement;

class NearestPlacements : public testing::Test {
 protected:
  NearestPlacements() { std::filesystem::create_directories(path_); }
  ~NearestPlacements() override { std::filesystem::remove_all(path_); }
  void write(const std::string& name, const std::vector<ExactPlacement>& placements) const {
    std::ofstream(path_ / name, std::ios::binary) << encode_placements(placements);
  }
  std::filesystem::path path_ = std::filesystem::temp_directory_path() / ("dapple_nearest_" + std::to_string(getpid()));
};

ExactPlacement at(double x, double y, double z, double scale = 1) {
  return {scale, 0, 0, x, 0, scale, 0, y, 0, 0, scale, z};
}

Transform transform_of(const ExactPlacement& m) {
  M44d out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out[r][c] = m[size_t(4 * r + c)];
  return Transform(out);
}

// Turned, of scales that differ along its axes.
ExactPlacement random_place(KeyedRng& rng, double spread) {
  const auto random = [&] { return double(rng.next()); };
  const Transform t = Transform::translate(V3d(random() - 0.5, random() - 0.5, random() - 0.5) * spread) *
                      Transform::rotate(360 * random(), V3d(random() - 0.5, random() - 0.5, random() + 0.1)) *
                      Transform::scale(V3d(0.3 + random(), 0.3 + random(), 0.3 + random()));
  ExactPlacement out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) out[size_t(4 * r + c)] = t.matrix()[r][c];
  return out;
}

std::vector<float> widths(const CameraView& view, const std::vector<Transform>& places) {
  std::vector<float> out;
  for (const Transform& t : places) {
    const V3f origin = t.point(V3f(0, 0, 0));
    float width;
    view.pixel_widths({&origin, 1}, &width);
    const auto& m = t.matrix();
    double scale = 0;
    for (int j = 0; j < 3; ++j) scale = std::max(scale, V3d(m[0][j], m[1][j], m[2][j]).length());
    out.push_back(width / float(scale));
  }
  std::sort(out.begin(), out.end());
  return out;
}

constexpr const char* surface =
    "Shape \"catmullclark\" \"point3 P\" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0 ] \"integer indices\" [ 0 1 2 3 ] "
    "\"integer faceverts\" [ 4 ]";

// Rationale: three levels of random maps, whose products are known. Expectation: the sixteen of the smallest pixels are
// found, whatever the camera.
TEST_F(NearestPlacements, AreThoseOfAll) {
  KeyedRng rng(7);
  std::vector<ExactPlacement> leaves(9), twigs(40), trees(1500);
  for (auto& m : leaves) m = random_place(rng, 1);
  for (auto& m : twigs) m = random_place(rng, 5);
  for (auto& m : trees) m = random_place(rng, 400);
  write("leaves.places", leaves), write("twigs.places", twigs), write("trees.places", trees);
  for (const char* camera :
       {"Camera \"perspective\" \"float fov\" 40", "Scale .5 .5 .5 Camera \"perspective\" \"float fov\" 90",
        "Camera \"orthographic\" \"float screenwindow\" [ -20 20 -15 15 ]", "Camera \"spherical\""}) {
    Diagnostics diagnostics;
    const auto d = scenefile::parse_pbrt(
        fmt::format("LookAt 3 -60 8  0 0 0  0 0 1\n{}\nWorldBegin\nObjectBegin \"leaf\" {} ObjectEnd\n"
                    "ObjectBegin \"twig\" ObjectInstances \"leaf\" \"string filename\" \"leaves.places\" ObjectEnd\n"
                    "ObjectBegin \"tree\" ObjectInstances \"twig\" \"string filename\" \"twigs.places\" ObjectEnd\n"
                    "Rotate 20 0 0 1 ObjectInstances \"tree\" \"string filename\" \"trees.places\"\n",
                    camera, "Shape \"sphere\""),
        "test.pbrt", path_.string(), diagnostics);
    const BuiltScene built = build_scene(d, {}, diagnostics);
    image::TextureSystem textures;
    const BuildContext context{d, diagnostics, textures, false, {V3d(0, 0, 0), std::vector<V3d>(3, V3d(0, 0, 0))}};
    const CameraView view(built.scene->camera);
    const auto found = nearest_placements(context, {1, 0, 0}, view);
    ASSERT_EQ(found[0].size(), InstancesView::most_placements);
    EXPECT_TRUE(found[1].empty() && found[2].empty());
    std::vector<Transform> places;
    for (const auto& a : trees)
      for (const auto& b : twigs)
        for (const auto& c : leaves)
          places.push_back(Transform::rotate(20, V3d(0, 0, 1)) * transform_of(a) * transform_of(b) * transform_of(c));
    const auto expected = widths(view, places), its = widths(view, found[0]);
    for (size_t i = 0; i < its.size(); ++i) EXPECT_NEAR(its[i], expected[i], 1.1e-3f * expected[i]) << camera << i;
  }
}

size_t vertices(const BuiltScene& built) {
  size_t sum = 0;
  for (uint32_t g = 0; g < built.scene->traced.geometry_count(); ++g)
    if (const auto* grids = std::get_if<trace::GridsPtr>(&built.scene->traced.shape(g))) sum += (*grids)->P.size();
  return sum;
}

// Rationale: of 200,000 places all but one are far; that one is near. Expectation: as fine as it alone.
TEST_F(NearestPlacements, MayBeAnywhereInAFile) {
  const auto vertices_of = [&](const std::vector<ExactPlacement>& places) {
    write("all.places", places);
    Diagnostics diagnostics;
    return vertices(build_scene(
        scenefile::parse_pbrt(fmt::format("LookAt 0 -6 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 40\n"
                                          "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100\n"
                                          "WorldBegin\nObjectBegin \"leaf\" Rotate 90 1 0 0 {} ObjectEnd\n"
                                          "ObjectInstances \"leaf\" \"string filename\" \"all.places\"\n",
                                          surface),
                              "test.pbrt", path_.string(), diagnostics),
        {}, diagnostics));
  };
  std::vector<ExactPlacement> places;
  for (int i = 0; i < 200000; ++i) places.push_back(at(3 * (i % 500) - 750, 900 + i / 500, 0));
  const size_t far = vertices_of(places), near = vertices_of({at(0, 0, 0)});
  EXPECT_LT(far * 10, near);
  for (const size_t last : {size_t(70001), size_t(199999)}) {
    auto with = places;
    with[last] = at(0, 0, 0);
    EXPECT_EQ(vertices_of(with), near) << last;
  }
}

// Rationale: 60,000 objects of 60,000 places, all about the camera, and twice the same place: no ball tells more than
// another. Expectation: places are found at once, since no more is looked at than the budget.
TEST_F(NearestPlacements, AreFoundAmongBillions) {
  const std::vector<ExactPlacement> heap(60000, at(0, 0, 0));
  write("heap.places", heap);
  Diagnostics diagnostics;
  const auto d = scenefile::parse_pbrt(
      "LookAt 0 -6 0  0 0 0  0 0 1\nCamera \"orthographic\"\nWorldBegin\nObjectBegin \"leaf\" Shape \"sphere\" "
      "ObjectEnd\nObjectBegin \"tree\" ObjectInstances \"leaf\" \"string filename\" \"heap.places\" ObjectEnd\n"
      "ObjectInstances \"tree\" \"string filename\" \"heap.places\"\n",
      "test.pbrt", path_.string(), diagnostics);
  image::TextureSystem textures;
  const BuildContext context{d, diagnostics, textures, false, {V3d(0, 0, 0), std::vector<V3d>(2, V3d(0, 0, 0))}};
  const CameraView view{scene::Camera()};
  EXPECT_EQ(nearest_placements(context, {1, 0}, view)[0].size(), InstancesView::most_placements);
  EXPECT_TRUE(diagnostics.messages().empty());
}

}  // namespace
}  // namespace dapple::build
