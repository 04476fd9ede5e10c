// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/build/camera_view.h"
#include "dapple/build/scene_builder.h"

namespace dapple::build {
namespace {

using Messages = std::vector<std::string>;

struct Built {
  BuiltScene built;
  std::vector<std::string> messages;

  const geom::GridMesh& grids(uint32_t geometry) const {
    return *std::get<trace::GridsPtr>(built.scene->traced.shape(geometry));
  }
  bool says(const std::string& text) const {
    return std::any_of(messages.begin(), messages.end(), [&](const std::string& m) { return m.find(text) != m.npos; });
  }
};

const std::string camera = R"(LookAt 0 -6 0  0 0 0  0 0 1
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 200 "integer yresolution" 200
WorldBegin
LightSource "infinite"
)";

Built build_scene_text(const std::string& world, const std::string& header = camera) {
  Diagnostics diagnostics;
  const auto description = scenefile::parse_pbrt(header + world, "test.pbrt", ".", diagnostics);
  BuiltScene built = build_scene(description, {}, diagnostics);
  return {std::move(built), diagnostics.messages()};
}

void expect_error(const std::string& world, const std::string& text) {
  try {
    build_scene_text(world);
    FAIL() << "no error: " << world;
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("test.pbrt:"), what.npos) << what;
    EXPECT_NE(what.find(text), what.npos) << what;
  }
}

// A cube over [-1, 1]^3; `parameters` are added to its directive.
std::string cube(const std::string& parameters,
                 const std::string& indices = "0 3 2 1  4 5 6 7  0 1 5 4  1 2 6 5  2 3 7 6  3 0 4 7") {
  return "Shape \"catmullclark\" \"point3 P\" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1]\n"
         "  \"integer indices\" [" +
         indices + "] " + parameters + "\n";
}

float largest_radius(const geom::GridMesh& mesh) {
  float r = 0;
  for (const V3f& p : mesh.P) r = std::max(r, length(p));
  return r;
}

TEST(DicedShapes, CatmullClarkIsDicedByTheCamera) {
  const auto count = [](const std::string& parameters, const std::string& header = camera) {
    return build_scene_text(cube(parameters), header).grids(0).micropolygon_count();
  };
  const size_t normal = count("");
  EXPECT_GT(normal, 4000u);
  EXPECT_NEAR(double(count("\"float shadingrate\" 4")), double(normal) / 4, double(normal) / 20);
  EXPECT_NEAR(double(count("", "Option \"float shadingrate\" 16\n" + camera)), double(normal) / 16,
              double(normal) / 50);
}

TEST(DicedShapes, OffScreenIsDicedMoreCoarsely) {
  const size_t seen = build_scene_text(cube("")).grids(0).micropolygon_count();
  const size_t beside = build_scene_text("Translate 30 -6 0\n" + cube("")).grids(0).micropolygon_count();
  const size_t behind = build_scene_text("Translate 0 -12 0\n" + cube("")).grids(0).micropolygon_count();
  EXPECT_LT(beside, seen / 16);
  EXPECT_LT(behind, seen / 8);
  EXPECT_GT(behind, 0u);
}

size_t vertices_in(const Built& b) {
  size_t n = 0;
  for (uint32_t g = 0; g < b.built.scene->traced.geometry_count(); ++g) n += b.grids(g).P.size();
  return n;
}

// A floor that begins below the camera would ask for any number of micropolygons there. Its patch gets at most 16
// pieces for each pixel along the picture: 16 x 16 = 256 along a side.
TEST(DicedShapes, WhatIsCloseToTheCameraIsBoundedByThePicture) {
  const std::string small = R"(LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
WorldBegin
LightSource "infinite"
)";
  const std::string floor =
      "Shape \"catmullclark\" \"point3 P\" [-1e4 -1 -1e4  1e4 -1 -1e4  1e4 -1 1e4  -1e4 -1 1e4] \"integer indices\" [0 "
      "1 2 3]\n";
  const Built b = build_scene_text(floor, small);
  EXPECT_LE(b.grids(0).micropolygon_count(), 256u * 256u);
  EXPECT_GE(b.grids(0).micropolygon_count(), 128u * 128u);
  EXPECT_EQ(b.messages, std::vector<std::string>());
  // 1024 patches, each as wide: the scene's budget holds them, 2^21 vertices and 64 a pixel.
  const std::string displaced =
      "Shape \"trianglemesh\" \"point3 P\" [-1e5 -1 -1e5  1e5 -1 -1e5  1e5 -1 1e5] \"integer indices\" [0 1 2] "
      "\"float displacement\" 50 \"float shadingrate\" 1e-6\n";
  const Built many = build_scene_text(displaced + displaced + displaced, small);
  EXPECT_LE(vertices_in(many), (size_t(1) << 21) + 64u * 256u + 3);
  EXPECT_GT(vertices_in(many), size_t(1) << 18);
  EXPECT_EQ(std::count_if(many.messages.begin(), many.messages.end(),
                          [](const std::string& m) { return m.find("so that the scene has") != m.npos; }),
            1);
}

// Shapes that together want more than the scene may have are coarsened, those of less than their share are left alone.
TEST(DicedShapes, TheSceneKeepsToABudget) {
  const std::string fine = cube("\"float shadingrate\" 0.002"), normal = cube("");
  const size_t budget = (size_t(1) << 21) + 64u * 200u * 200u;
  const Built b = build_scene_text(normal + fine + fine + fine + fine);
  EXPECT_LE(vertices_in(b), budget + 5);
  EXPECT_GT(vertices_in(b), budget / 8);
  EXPECT_EQ(b.grids(0).micropolygon_count(), build_scene_text(normal).grids(0).micropolygon_count());
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_TRUE(b.says("test.pbrt:8:1"));  // the second cube
}

// The limit of a triangle's subdivision does not depend on the levels but for how finely it is cut: 4^levels triangles.
TEST(LoopShapes, DeepLevelsAreHeldToANumberOfTrianglesInAll) {
  const auto triangle = [](int levels) {
    return "Shape \"loopsubdiv\" \"integer indices\" [0 1 2] \"point3 P\" [0 0 0 1 0 0 0 0 1] \"integer levels\" " +
           std::to_string(levels) + "\n";
  };
  const auto faces = [](const Built& b) {
    size_t n = 0;
    for (uint32_t g = 0; g < b.built.scene->traced.geometry_count(); ++g)
      n += std::get<trace::MeshPtr>(b.built.scene->traced.shape(g))->face_count();
    return n;
  };
  EXPECT_EQ(faces(build_scene_text(triangle(5))), 1024u);
  const Built b = build_scene_text(triangle(12) + triangle(2) + triangle(11));
  EXPECT_EQ(faces(b), 2u * 65536u + 16u);
  EXPECT_EQ(b.messages.size(), 1u);
  EXPECT_TRUE(b.says("test.pbrt:6:1"));
}

// Positions and normals of a surface do not depend on who cut its polygons.
TEST(LoopShapes, PolygonsAreCutIntoTriangles) {
  const auto mesh_of = [](const Built& b) { return std::get<trace::MeshPtr>(b.built.scene->traced.shape(0)); };
  const std::string cube_points =
      "Shape \"loopsubdiv\" \"point3 P\" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1] ";
  const std::string quads = "\"integer indices\" [0 3 2 1  4 5 6 7  0 1 5 4  1 2 6 5  2 3 7 6  3 0 4 7] ";
  const std::string cut =
      "\"integer indices\" [0 3 2 0 2 1  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7] ";
  // A C seen from above: a fan from its first corner would lie outside.
  const std::string c_shape =
      "Shape \"loopsubdiv\" \"integer levels\" 0 \"point3 P\" [2 1 0  2 2 0  0 2 0  0 0 0  2 0 0  1 .5 0  1 1.5 0] ";
  const Built by_sizes = build_scene_text(cube_points + quads + "\"integer faceverts\" [4 4 4 4 4 4]"),
              by_hand = build_scene_text(cube_points + cut);
  EXPECT_EQ(by_sizes.messages, Messages());
  EXPECT_EQ(mesh_of(by_sizes)->P, mesh_of(by_hand)->P);
  EXPECT_EQ(mesh_of(by_sizes)->indices, mesh_of(by_hand)->indices);
  const Built diced = build_scene_text(cube_points + quads + "\"integer faceverts\" [4 4 4 4 4 4] \"bool diced\" true");
  EXPECT_EQ(diced.messages, Messages());
  EXPECT_EQ(diced.grids(0).grids.size(),
            build_scene_text(cube_points + cut + "\"bool diced\" true").grids(0).grids.size());

  const Built c = build_scene_text(c_shape + "\"integer indices\" [0 1 2 3 4 5 6] \"integer faceverts\" [7]");
  ASSERT_EQ(mesh_of(c)->indices.size(), 15u);
  for (size_t t = 0; t < 15; t += 3) {
    const auto p = [&](size_t k) { return mesh_of(c)->P[mesh_of(c)->indices[t + k]]; };
    EXPECT_GT(cross(p(1) - p(0), p(2) - p(0)).z, 0) << t;
  }
}

TEST(LoopShapes, SayThatTheyTakeTriangles) {
  const std::string cube_points =
      "Shape \"loopsubdiv\" \"point3 P\" [-1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1] ";
  expect_error(cube_points + "\"integer indices\" [0 3 2 1]",
               "\"indices\" has 4 numbers; expected a multiple of 3, or \"faceverts\"");
  expect_error(cube_points + "\"integer indices\" [0 3 2 1] \"integer faceverts\" [3]",
               "\"faceverts\" adds up to 3 corners");
  const Built quads =
      build_scene_text(cube_points + "\"integer indices\" [0 3 2 1  4 5 6 7  0 1 5 4  1 2 6 5  2 3 7 6  3 0 4 7]");
  ASSERT_EQ(quads.messages.size(), 1u);
  EXPECT_TRUE(quads.says("use \"catmullclark\""));
  const Built pairs = build_scene_text(cube_points + "\"integer indices\" [0 1  0 3 2] \"integer faceverts\" [2 3]");
  ASSERT_EQ(pairs.messages.size(), 1u);
  EXPECT_TRUE(pairs.says("1 face left out: expected 3 corners or more"));
}

// OpenSubdiv would print on its own, and refuses a vertex of 65536 faces.
TEST(LoopShapes, WhatCannotBeSubdividedIsSaidOnce) {
  constexpr int n = 66000;
  std::string points = "0 0 0", corners;
  for (int i = 0; i < n; ++i) {
    points += " " + std::to_string(std::cos(2 * pi * float(i) / n)) + " " +
              std::to_string(std::sin(2 * pi * float(i) / n)) + " 0";
    corners += " 0 " + std::to_string(1 + i) + " " + std::to_string(1 + (i + 1) % n);
  }
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  expect_error(
      "Shape \"loopsubdiv\" \"integer levels\" 1 \"point3 P\" [" + points + "] \"integer indices\" [" + corners + "]",
      "the mesh cannot be subdivided: vertex with valence 66000 > 65535 max");
  EXPECT_EQ(testing::internal::GetCapturedStderr() + testing::internal::GetCapturedStdout(), "");
}

TEST(DicedShapes, CreasesCornersHolesAndBoundariesAreRead) {
  const float smooth = largest_radius(build_scene_text(cube("")).grids(0));
  EXPECT_LT(smooth, 1);
  const Built sharp = build_scene_text(cube(R"("integer cornerindices" [0 6] "float cornersharpness" 10)"));
  EXPECT_NEAR(largest_radius(sharp.grids(0)), std::sqrt(3.0f), 1e-5f);
  const Built creased = build_scene_text(
      cube(R"("integer creaseindices" [4 5 6 7 4  0 1] "integer creaselengths" [5 2] "float creasesharpness" [10 2])"));
  EXPECT_GT(largest_radius(creased.grids(0)), 1.05f);
  const Built holed = build_scene_text(cube(R"("integer holes" [1 2])"));
  EXPECT_EQ(holed.grids(0).grids.size(), 4u);
  EXPECT_EQ(holed.grids(0).parts[1].face, 3u);
  EXPECT_TRUE(build_scene_text(cube(R"("string boundary" "none")", "0 3 2 1")).built.scene->traced.bounds().isEmpty());
  EXPECT_EQ(creased.messages, std::vector<std::string>());
}

// A constant displacement of a sphere-like surface moves all of it outwards, whatever the transform and the orientation
// say of sides.
TEST(DicedShapes, DisplacementIsAlongTheOutsideNormal) {
  const float r = largest_radius(build_scene_text(cube("")).grids(0));
  EXPECT_NEAR(largest_radius(build_scene_text(cube("\"float displacement\" 0.5")).grids(0)), r + 0.5f, 1e-3f);
  EXPECT_NEAR(largest_radius(build_scene_text("Scale -1 1 1\n" + cube("\"float displacement\" 0.5")).grids(0)),
              r + 0.5f, 1e-3f);
  EXPECT_LT(largest_radius(build_scene_text("ReverseOrientation\n" + cube("\"float displacement\" 0.2")).grids(0)),
            r - 0.1f);
}

const std::string checks =
    R"(Texture "c" "float" "checkerboard" "float tex1" 0 "float tex2" 0.25 "float uscale" 4 "float vscale" 4
)";

TEST(DicedShapes, MeshesOfAllKindsAreDisplacedByATexture) {
  const std::string quad =
      R"("point3 P" [-1 0 -1  1 0 -1  -1 0 1  1 0 1] "point2 uv" [0 0 1 0 0 1 1 1] "texture displacement" "c")";
  for (const std::string& world : {checks + "Shape \"bilinearmesh\" " + quad,
                                   checks + "Shape \"trianglemesh\" \"integer indices\" [0 1 3  0 3 2] " + quad,
                                   checks + "Shape \"catmullclark\" \"integer indices\" [0 1 3 2] " + quad,
                                   checks + "Shape \"loopsubdiv\" \"integer indices\" [0 1 3  0 3 2] \"point3 P\" [-1 "
                                            "0 -1  1 0 -1  -1 0 1  1 0 1] \"texture displacement\" \"c\""}) {
    const Built b = build_scene_text(world);
    EXPECT_EQ(b.messages, std::vector<std::string>());
    const geom::GridMesh& mesh = b.grids(0);
    size_t high = 0;
    for (const V3f& p : mesh.P) {
      EXPECT_LE(p.y, 1e-6f);
      EXPECT_GE(p.y, -0.25f - 1e-6f);
      high += p.y < -0.125f;
    }
    EXPECT_NEAR(double(high) / double(mesh.P.size()), 0.5, 0.15) << world;
  }
}

TEST(DicedShapes, DisplacementBoundClampsAndWarnsOnce) {
  const Built b = build_scene_text(cube("\"float displacement\" 0.5 \"float displacementbound\" 0.1"));
  EXPECT_TRUE(b.says("displacementbound"));
  EXPECT_EQ(b.messages.size(), 1u);
  EXPECT_NEAR(largest_radius(b.grids(0)), largest_radius(build_scene_text(cube("")).grids(0)) + 0.1f, 1e-3f);
}

TEST(DicedShapes, LoopIsDicedOnRequest) {
  const std::string octahedron = R"(Shape "loopsubdiv" "point3 P" [1 0 0 0 1 0 -1 0 0 0 -1 0 0 0 1 0 0 -1]
    "integer indices" [0 1 4 1 2 4 2 3 4 3 0 4 1 0 5 2 1 5 3 2 5 0 3 5] )";
  const Built diced = build_scene_text(octahedron + "\"bool diced\" true"),
              refined = build_scene_text(octahedron + "\"integer levels\" 6");
  EXPECT_EQ(diced.grids(0).grids.size(), 24u);
  const Box3f a = diced.built.scene->traced.bounds(), b = refined.built.scene->traced.bounds();
  EXPECT_LT(length(a.max - b.max), 1e-3f);
}

TEST(DicedShapes, AreaLightsAreNamedAsUnsupported) {
  EXPECT_TRUE(build_scene_text("AreaLightSource \"diffuse\"\n" + cube("")).says("an area light on a diced surface"));
}

TEST(DicedShapes, InstancesAreDicedForTheNearest) {
  const std::string object = "ObjectBegin \"o\"\n" + cube("") + "ObjectEnd\n";
  const std::string far_away = "AttributeBegin Translate 0 40 0 ObjectInstance \"o\" AttributeEnd\n";
  const size_t one = build_scene_text(object + far_away).grids(0).micropolygon_count();
  std::string many = object;
  for (int i = 0; i < 40; ++i) many += far_away;
  const size_t both = build_scene_text(many + "ObjectInstance \"o\"").grids(0).micropolygon_count();
  EXPECT_GT(both, 16 * one);
}

TEST(DicedShapes, BadCagesAreErrorsWithAPlace) {
  expect_error(cube("", "0 3 2 8"), "\"indices\" names vertex 8");
  expect_error(cube("", "0 3 2 -1"), "\"indices\" names vertex -1");
  expect_error(cube("", "0 3 2"), "multiple of 4");
  expect_error(cube("\"integer faceverts\" [3 4]", "0 3 2 1 4 5"), "adds up to 7");
  expect_error(cube("\"integer faceverts\" [-4]"), "-4");
  expect_error(cube("\"integer creaseindices\" [0 1] \"float creasesharpness\" -1"), "-1");
  expect_error(cube("\"integer creaseindices\" [0 99] \"float creasesharpness\" 1"), "99");
  expect_error(cube("\"integer creaseindices\" [0 1 2] \"float creasesharpness\" 1"), "pairs");
  expect_error(cube("\"integer creaseindices\" [0 1 2] \"integer creaselengths\" [9] \"float creasesharpness\" 1"),
               "9");
  expect_error(
      cube("\"integer creaseindices\" [0 1 2] \"integer creaselengths\" [-2147483648] \"float creasesharpness\" 1"),
      "2147483648");
  expect_error(cube("\"integer creaseindices\" [0 1 1 2] \"float creasesharpness\" [1 2 3]"), "3 values");
  expect_error(cube("\"integer cornerindices\" [0 1]"), "0 values");
  expect_error(cube("\"integer holes\" [6]"), "face 6");
  expect_error(cube("\"string boundary\" \"open\""), "edgeandcorner");
  expect_error(cube("\"float shadingrate\" 0"), "above 0");
  expect_error(cube("\"float displacementbound\" -1"), "negative");
  expect_error(cube("\"point2 uv\" [0 0 1 1]"), "2 values for 8");
}

// Meshes that no surface should be made of: named, and the rest rendered.
TEST(DicedShapes, OddCagesAreNamedAndTheRestIsThere) {
  const auto names = [](const std::string& world, const std::string& text, size_t patches) {
    const Built b = build_scene_text(world);
    EXPECT_TRUE(b.says(text)) << text;
    EXPECT_EQ(b.grids(0).grids.size(), patches);
    for (const V3f& p : b.grids(0).P) EXPECT_TRUE(is_finite(p));
  };
  names(cube("", "0 3 2 1  0 1 0 2"), "a vertex comes twice", 1);
  names(cube("\"integer faceverts\" [4 2]", "0 3 2 1  0 1"), "3 corners or more", 1);
  names(cube("\"integer creaseindices\" [0 6] \"float creasesharpness\" 1"), "no face has such an edge", 6);
  std::string polygon = "\"integer faceverts\" [4 1000000]", indices = "0 3 2 1 ";
  for (int i = 0; i < 1000000; ++i) indices += "0 1 2 3 4 5 6 7 "[size_t(i) % 8 * 2] + std::string(" ");
  names(cube(polygon, indices), "more than 256 corners", 1);
}

// A fan of triangles at a vertex of n faces.
std::string fan(int n) {
  std::string P = "0 0 0.3 ", indices, sizes;
  for (int i = 0; i < n; ++i) {
    P += std::to_string(std::cos(2 * pi * float(i) / float(n))) + " " +
         std::to_string(std::sin(2 * pi * float(i) / float(n))) + " 0 ";
    indices += "0 " + std::to_string(1 + i) + " " + std::to_string(1 + (i + 1) % n) + " ";
    sizes += "3 ";
  }
  return "Shape \"catmullclark\" \"point3 P\" [" + P + "] \"integer indices\" [" + indices +
         "] \"integer faceverts\" [" + sizes + "]";
}

TEST(DicedShapes, NonManifoldAndDegenerateCagesRender) {
  const auto finite_patches = [](const std::string& world) {
    const Built b = build_scene_text(world);
    for (const V3f& p : b.grids(0).P) EXPECT_TRUE(is_finite(p));
    for (const V3f& n : b.grids(0).N) EXPECT_TRUE(is_finite(n));
    return b.grids(0).grids.size();
  };
  for (const std::string displaced : {"", "\"float displacement\" 0.1"}) {
    EXPECT_EQ(finite_patches(cube(displaced, "0 3 2 1  0 3 7 4  0 3 6 5")), 3u) << "three faces at an edge";
    EXPECT_EQ(finite_patches(cube(displaced, "0 3 2 1  0 3 2 1")), 2u) << "a face twice";
    EXPECT_EQ(finite_patches(cube(displaced, "0 3 2 1  0 3 7 4")), 2u) << "faces turned against each other";
    EXPECT_EQ(finite_patches(cube(displaced, "0 1 2 3  6 5 4 7  0 6 1 7")), 3u) << "vertices without a fan";
    EXPECT_EQ(finite_patches("Scale 1 1 0.000001\n" + cube(displaced)), 6u) << "nearly flat";
    EXPECT_EQ(
        finite_patches("Shape \"catmullclark\" \"point3 P\" [0 0 0 0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2 3] " +
                       displaced),
        1u)
        << "no area";
  }
  EXPECT_EQ(finite_patches(fan(3)), 9u);
  EXPECT_EQ(finite_patches(fan(250)), 750u);
  EXPECT_TRUE(build_scene_text(fan(257)).says("faces meet at a vertex"));
}

// Samples miss the surface only near pixels that mostly miss it: at its silhouette.
TEST(DicedShapes, NoBackgroundInsideTheSilhouette) {
  const Built b = build_scene_text(R"(Texture "f" "float" "fbm"
    Texture "d" "float" "scale" "texture tex" "f" "float scale" .3
    Rotate 30 1 2 3
)" + cube(R"("integer creaseindices" [4 5 6 7 4] "integer creaselengths" [5] "float creasesharpness" 3 "texture displacement" "d")"));
  const scene::Scene& scene = *b.built.scene;
  const V2i size = scene.film.resolution;
  const auto rays = std::make_unique<trace::RayBatch>();
  const auto hits = std::make_unique<trace::HitBatch>();
  KeyedRng rng(1);
  std::vector<int> hit_count(size_t(size.x) * size_t(size.y));
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x) {
      for (int i = 0; i < 16; ++i) {
        const auto r = scene.camera.generate(V2f(float(x) + rng.next(), float(y) + rng.next()), V2f(0, 0), 0);
        rays->set(i, r.ray.o, r.ray.d, infinity, 0, 0);
      }
      scene.traced.intersect(*rays, 16, hits.get());
      for (int i = 0; i < 16; ++i) hit_count[size_t(y * size.x + x)] += hits->geometry[i] != trace::no_id;
    }
  int inside = 0, odd = 0;
  for (int y = 2; y + 2 < size.y; ++y)
    for (int x = 2; x + 2 < size.x; ++x) {
      bool at_silhouette = false;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) at_silhouette |= hit_count[size_t((y + dy) * size.x + x + dx)] < 8;
      if (at_silhouette) continue;
      ++inside;
      odd += hit_count[size_t(y * size.x + x)] < 16;
    }
  EXPECT_GT(inside, 5000);
  EXPECT_EQ(odd, 0);
}

TEST(CameraView, PixelsAreAsWideAsTheCamerasRays) {
  for (const char* type : {R"("perspective" "float fov" 50)", R"("orthographic" "float screenwindow" [-3 3 -3 3])",
                           R"("spherical" "string mapping" "equirectangular")"}) {
    const Built b = build_scene_text("", std::string("Scale 2 2 2 LookAt 1 2 3  0 0 0  0 0 1\nCamera ") + type +
                                             "\nFilm \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" "
                                             "100\nWorldBegin\nLightSource \"infinite\"\n");
    const scene::Camera& c = b.built.scene->camera;
    const auto r = c.generate(V2f(50, 50), V2f(0, 0), 0), beside = c.generate(V2f(50, 51), V2f(0, 0), 0);
    const V3f P[1] = {r.ray.o + r.ray.d * 7.0f};
    const V3f Q = beside.ray.o + beside.ray.d * 7.0f;
    float width;
    CameraView(c).pixel_widths(P, &width);
    EXPECT_NEAR(width, length(Q - P[0]), 0.01f * width) << type;
    EXPECT_NEAR(r.cone_width + 7 * r.cone_spread, width, 1e-4f * width) << type;
    EXPECT_NEAR(c.pixel_width(P[0]), width, 1e-4f * width) << type;
  }
}

}  // namespace
}  // namespace dapple::build
