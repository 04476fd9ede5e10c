// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/level_of_detail.h"

#include <gtest/gtest.h>

#include <random>

#include "dapple/base/parallel.h"
#include "dapple/build/editable_scene.h"
#include "dapple/scenefile/pbrt_parser.h"

namespace dapple::build {
namespace {

BuiltScene build_text(const std::string& text, const BuildOptions& options = {}) {
  Diagnostics diagnostics;
  return build_scene(scenefile::parse_pbrt(text, "test.pbrt", ".", diagnostics), options, diagnostics);
}

/// A mesh of 1000 leaves, triangles of sides of .1, in a ball of radius 1 about the origin.
std::string leaves(const std::string& params = "") {
  std::mt19937 rng(1);
  std::uniform_real_distribution<float> u(-1, 1);
  std::string points, indices;
  for (int i = 0; i < 1000;) {
    const V3f p(u(rng), u(rng), u(rng)), n = normalize(V3f(u(rng), u(rng), u(rng)));
    const V3f a = normalize(cross(n, V3f(u(rng), u(rng), u(rng)))) * 0.1f, b = cross(n, a);
    if (length(p) > 1) continue;
    for (const V3f& c : {p, p + a, p + b})
      points += std::to_string(c.x) + ' ' + std::to_string(c.y) + ' ' + std::to_string(c.z) + ' ';
    for (int k = 0; k < 3; ++k) indices += std::to_string(3 * i + k) + ' ';
    ++i;
  }
  return "Shape \"trianglemesh\" " + params + " \"point3 P\" [ " + points + "] \"integer indices\" [ " + indices +
         "]\n";
}

std::string scene(const std::string& camera, const std::string& world) {
  return camera + "\nFilm \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100\nWorldBegin\n" + world;
}

BuildOptions at(float lod) {
  BuildOptions options;
  options.lod = lod;
  return options;
}

/// Leaves that are kept of those in meshes that could be pruned; 0: of none.
size_t kept(const std::string& camera, const std::string& world, float lod = 1) {
  return build_text(scene(camera, world), at(lod)).times.pruned.kept;
}

const std::string near_camera = "LookAt 0 0 -3  0 0 0  0 1 0  Camera \"perspective\" \"float fov\" 40";
const std::string far_camera = "LookAt 0 0 -30  0 0 0  0 1 0  Camera \"perspective\" \"float fov\" 40";

TEST(LevelOfDetail, GoesByTheDistance) {
  EXPECT_EQ(kept(near_camera, leaves()), 1000u);
  const size_t far = kept(far_camera, leaves());
  EXPECT_GT(far, 10u);
  EXPECT_LT(far, 700u);
  EXPECT_LT(far, kept(far_camera, leaves(), 0.5f));
  EXPECT_LE(kept(far_camera, leaves(), 0.5f), 1000u);
  EXPECT_EQ(kept(far_camera, leaves(), 0), 0u);  // nothing was looked at
}

TEST(LevelOfDetail, GoesByTheProjection) {
  const auto orthographic = [](const char* half) {
    return std::string("LookAt 0 0 -90  0 0 0  0 1 0  Camera \"orthographic\" \"float screenwindow\" [ -") + half +
           ' ' + half + " -" + half + ' ' + half + " ]";
  };
  EXPECT_EQ(kept(orthographic("1.5"), leaves()), 1000u);
  EXPECT_LT(kept(orthographic("11"), leaves()), 700u);
  const std::string spherical = " Camera \"spherical\" ";
  EXPECT_EQ(kept("LookAt 0 0 -1.1  0 0 0  0 1 0" + spherical, leaves()), 1000u);
  EXPECT_LT(kept("LookAt 0 0 -9  0 0 0  0 1 0" + spherical, leaves()), 700u);
  EXPECT_EQ(kept("LookAt 0 0 0  0 0 1  0 1 0  Camera \"perspective\" \"float fov\" 40", leaves()), 1000u);
}

TEST(LevelOfDetail, GoesByTheNearestInstance) {
  const std::string object = "ObjectBegin \"tree\"\n" + leaves() + "ObjectEnd\n";
  const std::string far = "ObjectInstance \"tree\"\nTranslate 5 0 0 ObjectInstance \"tree\"\n";
  const std::string near = "AttributeBegin Translate 0 0 -27 ObjectInstance \"tree\" AttributeEnd\n";
  EXPECT_LT(kept(far_camera, object + far), 700u);
  EXPECT_EQ(kept(far_camera, object + near + far), 1000u);
  EXPECT_EQ(kept(far_camera, object + "Scale 10 10 10\n" + far), 1000u);
  EXPECT_EQ(kept(far_camera, object), 0u);  // placed nowhere
  const std::string nested =
      "ObjectBegin \"grove\"\nObjectInstance \"tree\"\nTranslate 3 0 0\nObjectInstance \"tree\"\nObjectEnd\n";
  EXPECT_LT(kept(far_camera, object + nested + "ObjectInstance \"grove\"\n"), 700u);
  EXPECT_EQ(kept(far_camera, object + nested + "Translate 0 0 -27 ObjectInstance \"grove\"\n"), 1000u);
}

// The origin of the nearest lies below the picture, where pixels count as wider than those at the others.
TEST(LevelOfDetail, GoesByTheNearestOfManyInstances) {
  const std::string camera = "LookAt 0 12 -3  0 12 10  0 1 0  Camera \"perspective\" \"float fov\" 40";
  const std::string object = "ObjectBegin \"tree\"\nTranslate 0 12 0\n" + leaves() + "ObjectEnd\n";
  const std::string near = "ObjectInstance \"tree\"\n";
  std::string far;
  for (int i = 0; i < 20; ++i)
    far += "AttributeBegin Translate " + std::to_string(i - 10) + " 0 40 ObjectInstance \"tree\" AttributeEnd\n";
  EXPECT_LT(kept(camera, object + far), 700u);
  EXPECT_EQ(kept(camera, object + near + far), 1000u);
  const auto nested = [](const std::string& places) {
    return "ObjectBegin \"grove\"\n" + places + "ObjectEnd\nObjectInstance \"grove\"\n";
  };
  EXPECT_LT(kept(camera, object + nested(far)), 700u);
  EXPECT_EQ(kept(camera, object + nested(near + far)), 1000u);
}

TEST(LevelOfDetail, GoesByBothEndsOfTheMotion) {
  const std::string moves = "ActiveTransform EndTime Translate 0 0 -27 ActiveTransform All\n";
  EXPECT_EQ(kept(far_camera, moves + leaves()), 1000u);
  EXPECT_LT(kept(far_camera, "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All\n" + leaves()), 700u);
  const std::string object = "ObjectBegin \"tree\"\n" + leaves() + "ObjectEnd\n";
  EXPECT_EQ(kept(far_camera, object + moves + "ObjectInstance \"tree\"\n"), 1000u);
  EXPECT_EQ(kept("ActiveTransform EndTime Translate 0 0 -27 ActiveTransform All\n" + far_camera, leaves()), 1000u);
}

TEST(LevelOfDetail, LeavesWhatShinesBoundsMediaOrSaysSo) {
  EXPECT_EQ(kept(far_camera, leaves("\"bool lod\" false")), 0u);
  EXPECT_LT(kept(far_camera, leaves("\"bool lod\" true")), 700u);
  EXPECT_EQ(kept(far_camera, "AreaLightSource \"diffuse\"\n" + leaves()), 0u);
  EXPECT_EQ(kept(far_camera,
                 "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nMediumInterface \"fog\" \"\"\n" + leaves()),
            0u);
  EXPECT_EQ(kept(far_camera, "Texture \"d\" \"float\" \"constant\" \"float value\" .01\n" +
                                 leaves("\"texture displacement\" \"d\"")),
            0u);
}

TEST(LevelOfDetail, IsAParameterOfMeshesAlone) {
  const auto warnings = [](const std::string& shape) {
    Diagnostics diagnostics;
    const auto text = scene(far_camera, "LightSource \"infinite\"\n" + shape);
    build_scene(scenefile::parse_pbrt(text, "test.pbrt", ".", diagnostics), {}, diagnostics);
    return diagnostics.messages();
  };
  EXPECT_TRUE(warnings(leaves("\"bool lod\" false")).empty());
  const auto of_sphere = warnings("Shape \"sphere\" \"bool lod\" false\n");
  ASSERT_EQ(of_sphere.size(), 1u);
  EXPECT_NE(of_sphere[0].find("lod"), std::string::npos) << of_sphere[0];
}

TEST(LevelOfDetail, IsSaidByTheScene) {
  const auto with = [](const std::string& option, const BuildOptions& options = {}) {
    return build_text(scene(far_camera + "\nOption " + option, leaves()), options).times.pruned.kept;
  };
  EXPECT_EQ(build_text(scene(far_camera, leaves())).times.pruned.components, 0u);
  EXPECT_EQ(with("\"string lod\" \"off\""), 0u);
  EXPECT_EQ(with("\"string lod\" \"1\""), kept(far_camera, leaves()));
  EXPECT_EQ(with("\"string lod\" \"auto\""), kept(far_camera, leaves(), *level_of_detail("auto")));
  EXPECT_EQ(with("\"string lod\" \"1\"", at(0)), 0u);
  for (const char* bad : {"", "on", "0", "-1", "65", "nan", "inf", "1 2", "1px"}) {
    EXPECT_FALSE(level_of_detail(bad)) << bad;
    try {
      with(std::string("\"string lod\" \"") + bad + '"');
      ADD_FAILURE() << bad;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("test.pbrt:2:"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(with("\"float lod\" 1"), InputError);
}

TEST(LevelOfDetail, IsTheSameForAnyThreads) {
  std::string world;
  for (int i = 0; i < 8; ++i) world += "Translate 2 0 0\n" + leaves();
  set_thread_count(1);
  const BuiltScene one = build_text(scene(far_camera, world), at(1));
  set_thread_count(4);
  const BuiltScene many = build_text(scene(far_camera, world), at(1));
  set_thread_count(0);
  EXPECT_EQ(one.scene->fingerprint, many.scene->fingerprint);
  EXPECT_EQ(one.times.pruned.kept, many.times.pruned.kept);
  EXPECT_EQ(one.times.pruned.components, 8000u);
  EXPECT_LT(one.times.pruned.kept, 5600u);
}

// Look-ups in the parameters of a material that shapes share are not for several threads (seen by the sanitizer, and as
// crashes).
TEST(LevelOfDetail, ShapesShareMaterials) {
  std::string world;
  for (int m = 0; m < 200; ++m) {
    const std::string name = "\"m" + std::to_string(m) + '"';
    world += "MakeNamedMaterial " + name +
             " \"string type\" \"openpbr\" \"float transmission_depth\" 1 \"float transmission_weight\" 0\n" +
             "NamedMaterial " + name + "\n";
    for (int i = 0; i < 8; ++i)
      world += "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 0 1 0 0 0 1 ] \"integer indices\" [ 0 1 2 ]\n";
  }
  world += leaves();
  set_thread_count(8);
  const size_t of_many = kept(far_camera, world);
  set_thread_count(0);
  EXPECT_EQ(of_many, kept(far_camera, leaves()));
}

// Where there is a dicing camera, the camera may go anywhere.
TEST(LevelOfDetail, FollowsTheDicingCamera) {
  const auto description = [](const std::string& dicing, const char* to) {
    Diagnostics diagnostics;
    const std::string edit = std::string("DicingCamera\nEdit \"camera\" \"float lookat\" [ ") + to + " ]\n";
    return scenefile::parse_pbrt(scene(dicing, leaves() + edit), "test.pbrt", ".", diagnostics);
  };
  const char *far = "0 0 -30  0 0 0  0 1 0", *near = "0 0 -3  0 0 0  0 1 0";
  Diagnostics diagnostics;
  auto d = description(far_camera, far);
  EditableScene scene(d, at(1), diagnostics);
  const size_t first = scene.built().times.pruned.kept;
  const uint64_t fingerprint = scene.built().scene->fingerprint;
  EXPECT_LT(first, 700u);
  d = description(far_camera, near);
  EXPECT_FALSE(scene.update({.camera = true}).geometry);
  EXPECT_EQ(scene.built().scene->fingerprint, fingerprint);
  EXPECT_EQ(scene.built().times.pruned.kept, first);
  d = description(near_camera, near);
  scene.update({.camera = true});
  EXPECT_EQ(scene.built().times.pruned.kept, 1000u);
}

}  // namespace
}  // namespace dapple::build
