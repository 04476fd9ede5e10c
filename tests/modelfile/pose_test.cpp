// SPDX-License-Identifier: Apache-2.0
// Animation, skins and morph targets: positions at a time, by closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/modelfile/models.h"

namespace dapple::modelfile {
namespace {

using scenefile::SceneDescription;
using test::GltfArrays;
using test::TempFolder;

constexpr double right_angle = std::numbers::pi / 2;

SceneDescription at_time(const std::string& path, double open, double shutter = 0) {
  ModelOptions options;
  options.time = {open, shutter};
  options.view.sky = "none";
  return test::read(path, options);
}

// Vertices (or normals) of the scene's only mesh, in the world, when the shutter opens or closes.
std::vector<V3f> vertices(const SceneDescription& s, const char* name = "P", bool end = false) {
  const auto& shape = s.shapes.at(0);
  const scenefile::Param* p = shape.params.find(name);
  std::vector<V3f> out;
  for (size_t i = 0; p && i + 2 < p->numbers.size(); i += 3) {
    const V3f v(p->numbers[i], p->numbers[i + 1], p->numbers[i + 2]);
    const auto& t = end ? shape.transform.end : shape.transform.start;
    out.push_back(std::string(name) == "N" ? t.vector(v) : t.point(v));
  }
  return out;
}

void expect_near(const V3f& found, const V3f& expected, const std::string& what) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], expected[k], 2e-5f) << what << ", axis " << k;
}

// A joint at (0, 1, 0) turns about z by a right angle in one second; vertex 0 hangs by half on it, the others all. The
// mesh's own node is moved, which says nothing for a skin.
std::string skinned_gltf() {
  GltfArrays a;
  a.floats("VEC3", {0, 2, 0, 0, 2, 0, 1, 2, 0});  // positions
  a.shorts("SCALAR", {0, 1, 2});
  a.shorts("VEC4", {0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});             // joints
  a.floats("VEC4", {.5f, .5f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});         // weights
  a.floats("MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1,  //
                    1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1});
  a.floats("SCALAR", {0, 1});
  a.floats("VEC4", {0, 0, 0, 1, 0, 0, std::sqrt(.5f), std::sqrt(.5f)});
  a.floats("VEC3", {1, 0, 0, 1, 0, 0, 1, 0, 0});  // normals
  return a.file(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"name":"cloth","mesh":0,"skin":0,"translation":[7,0,0]},{"name":"root","children":[2]},
{"name":"joint","translation":[0,1,0]}],
"skins":[{"joints":[1,2],"inverseBindMatrices":4}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3,"NORMAL":7},"indices":1}]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}}],
"samplers":[{"input":5,"output":6,"interpolation":"LINEAR"}]}])");
}

V3f turned(const V3f& p, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), y = double(p.y) - 1;
  return V3f(float(c * double(p.x) - s * y), float(1 + s * double(p.x) + c * y), p.z);
}

TEST(Poses, SkinsOfGltfFollowTheirJoints) {
  const TempFolder folder;
  const std::string path = folder.write("skin.gltf", skinned_gltf());
  for (const double t : {0.0, .25, .5, 1.0, 3.0}) {
    const double angle = right_angle * std::min(t, 1.0);
    const SceneDescription s = at_time(path, t);
    const std::vector<V3f> P = vertices(s), N = vertices(s, "N");
    ASSERT_EQ(P.size(), 3u);
    const std::string when = "at " + std::to_string(t);
    expect_near(P[0], (V3f(0, 2, 0) + turned(V3f(0, 2, 0), angle)) * .5f, when);
    expect_near(P[1], turned(V3f(0, 2, 0), angle), when);
    expect_near(P[2], turned(V3f(1, 2, 0), angle), when);
    ASSERT_EQ(N.size(), 3u);
    expect_near(normalize(N[2]), V3f(float(std::cos(angle)), float(std::sin(angle)), 0), when + ", normal");
  }
  // Without a time it is as it was bound.
  expect_near(vertices(at_time(path, -1))[2], V3f(1, 2, 0), "at rest");
}

TEST(Poses, SkinsAreBlurredBetweenTwoTimes) {
  const TempFolder folder;
  const std::string path = folder.write("skin.gltf", skinned_gltf());
  const SceneDescription s = at_time(path, .25, .5);
  const std::vector<V3f> P = vertices(s), P1 = vertices(s, "P1", true);
  ASSERT_EQ(P.size(), 3u);
  ASSERT_EQ(P1.size(), 3u);
  expect_near(P[1], turned(V3f(0, 2, 0), .25 * right_angle), "open");
  expect_near(P1[1], turned(V3f(0, 2, 0), .75 * right_angle), "closed");
  EXPECT_TRUE(vertices(at_time(path, .25, 0), "P1").empty());
}

// Two targets, whose weights go from 0, 0 to 1, 2 in one second, and are 1/2, 0 at rest.
std::string morphing_gltf() {
  GltfArrays a;
  a.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  a.shorts("SCALAR", {0, 1, 2});
  a.floats("VEC3", {0, 0, 1, 0, 0, 0, 0, 0, 0});
  a.floats("VEC3", {0, 0, 0, 0, 0, 0, 1, 2, 3});
  a.floats("SCALAR", {0, 1});
  a.floats("SCALAR", {0, 0, 1, 2});
  return a.file(R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"n","mesh":0,"translation":[10,0,0]}],
"meshes":[{"name":"m","weights":[0.5,0],"primitives":[{"attributes":{"POSITION":0},"indices":1,
"targets":[{"POSITION":2},{"POSITION":3}]}]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],
"samplers":[{"input":4,"output":5,"interpolation":"LINEAR"}]}])");
}

TEST(Poses, MorphTargetsAddUp) {
  const TempFolder folder;
  const std::string path = folder.write("morph.gltf", morphing_gltf());
  const auto expect = [](const std::vector<V3f>& P, float first, float second, const std::string& when) {
    ASSERT_EQ(P.size(), 3u) << when;
    expect_near(P[0], V3f(10, 0, first), when);
    expect_near(P[1], V3f(11, 0, 0), when);
    expect_near(P[2], V3f(10, 1, 0) + V3f(1, 2, 3) * second, when);
  };
  expect(vertices(at_time(path, -1)), .5f, 0, "at rest");
  for (const float t : {0.0f, .25f, .75f, 1.0f})
    expect(vertices(at_time(path, double(t))), t, 2 * t, std::to_string(t));
  const SceneDescription s = at_time(path, .25, .5);
  expect(vertices(s), .25f, .5f, "open");
  expect(vertices(s, "P1", true), .75f, 1.5f, "closed");
}

// A triangle that moves from x = 0 to 4 m in a second, z up; `more`, and connections of it.
std::string moving_fbx(const std::string& more, const std::string& connections, double centimetres) {
  return R"(; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
		P: "UpAxis", "int", "Integer", "",2
		P: "UpAxisSign", "int", "Integer", "",1
		P: "FrontAxis", "int", "Integer", "",1
		P: "FrontAxisSign", "int", "Integer", "",-1
		P: "CoordAxis", "int", "Integer", "",0
		P: "CoordAxisSign", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",)" +
         std::to_string(centimetres) + R"(
	}
}
Objects:  {
	Geometry: 100, "Geometry::tri", "Mesh" {
		Vertices: *9 {
			a: 0,0,0,1,0,0,0,1,0
		}
		PolygonVertexIndex: *3 {
			a: 0,1,-3
		}
		GeometryVersion: 124
		LayerElementMaterial: 0 {
			Version: 101
			Name: ""
			MappingInformationType: "AllSame"
			ReferenceInformationType: "IndexToDirect"
			Materials: *1 {
				a: 0
			}
		}
		Layer: 0 {
			Version: 100
			LayerElement:  {
				Type: "LayerElementMaterial"
				TypedIndex: 0
			}
		}
	}
	Model: 200, "Model::n", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,5,0
		}
	}
	Material: 300, "Material::red", "" {
		Version: 102
		ShadingModel: "lambert"
		Properties70:  {
			P: "DiffuseColor", "Color", "", "A",0.75,0.25,0.125
		}
	}
	AnimationStack: 400, "AnimStack::take", "" {
		Properties70:  {
			P: "LocalStop", "KTime", "Time", "",46186158000
		}
	}
	AnimationLayer: 500, "AnimLayer::base", "" {
	}
	AnimationCurveNode: 600, "AnimCurveNode::T", "" {
		Properties70:  {
			P: "d|X", "Number", "", "A",0
			P: "d|Y", "Number", "", "A",5
			P: "d|Z", "Number", "", "A",0
		}
	}
	AnimationCurve: 700, "AnimCurve::", "" {
		Default: 0
		KeyVer: 4008
		KeyTime: *2 {
			a: 0,46186158000
		}
		KeyValueFloat: *2 {
			a: 0,4
		}
	}
)" + more +
         R"(}
Connections:  {
	C: "OO",200,0
	C: "OO",100,200
	C: "OO",300,200
	C: "OO",500,400
	C: "OO",600,500
	C: "OP",600,200, "Lcl Translation"
	C: "OP",700,600, "d|X"
)" + connections +
         "}\n";
}

TEST(Poses, FbxFilesMoveAndSayWhatIsUp) {
  const TempFolder folder;
  const std::string path = folder.write("moves.fbx", moving_fbx("", "", 100));
  for (const float t : {0.0f, .25f, 1.0f}) {
    const std::vector<V3f> P = vertices(at_time(path, double(t)));
    ASSERT_EQ(P.size(), 3u);
    expect_near(P[1], V3f(1 + 4 * t, 5, 0), std::to_string(t));
  }
  const SceneDescription s = at_time(path, .25, .5);
  expect_near(vertices(s, "P", true)[0], V3f(3, 5, 0), "closed");
  EXPECT_GT(s.world_to_camera.start.vector(V3f(0, 0, 1)).y, .8f);  // z is up
  const auto& red = s.materials.at(size_t(s.shapes.at(0).material));
  ASSERT_TRUE(red.params.find("reflectance"));
  EXPECT_EQ(red.params.find("reflectance")->numbers, (std::vector<float>{.75f, .25f, .125f}));
  // In centimetres it is a hundredth of that.
  expect_near(vertices(at_time(folder.write("small.fbx", moving_fbx("", "", 1)), 0))[1], V3f(.01f, .05f, 0), "cm");
}

// The bone was bound at (0, 1, 0) and has turned by a right angle about z; the third vertex does not hang on it.
TEST(Poses, SkinsOfFbx) {
  const TempFolder folder;
  const std::string path = folder.write("skin.fbx", moving_fbx(R"(	Model: 201, "Model::bone", "LimbNode" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,1,0
			P: "Lcl Rotation", "Lcl Rotation", "", "A",0,0,90
		}
	}
	NodeAttribute: 202, "NodeAttribute::bone", "LimbNode" {
		TypeFlags: "Skeleton"
	}
	Deformer: 800, "Deformer::skin", "Skin" {
		Version: 101
		Link_DeformAcuracy: 50
	}
	Deformer: 801, "SubDeformer::bone", "Cluster" {
		Version: 100
		Indexes: *2 {
			a: 0,1
		}
		Weights: *2 {
			a: 1,1
		}
		Transform: *16 {
			a: 1,0,0,0,0,1,0,0,0,0,1,0,0,-1,0,1
		}
		TransformLink: *16 {
			a: 1,0,0,0,0,1,0,0,0,0,1,0,0,1,0,1
		}
	}
)",
                                                               R"(	C: "OO",201,0
	C: "OO",202,201
	C: "OO",800,100
	C: "OO",801,800
	C: "OO",201,801
)",
                                                               100));
  const std::vector<V3f> P = vertices(at_time(path, -1));
  ASSERT_EQ(P.size(), 3u);
  expect_near(P[0], V3f(1, 1, 0), "first");
  expect_near(P[1], V3f(1, 2, 0), "second");
}

}  // namespace
}  // namespace dapple::modelfile
