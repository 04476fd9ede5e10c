// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/scene_reader.h"

#include <gtest/gtest.h>

#include "tests/modelfile/models.h"

namespace dapple::modelfile {
namespace {

using scenefile::SceneDescription;
using test::TempFolder;

constexpr char house_mtl[] = R"(newmtl wall
Kd .6 .5 .4
Ks 0 0 0
illum 1
newmtl varnish
Kd .2 .1 .05
Ks .5 .5 .5
Ns 200
illum 2
newmtl mirror
Kd 0 0 0
Ks .9 .9 .9
Ns 900
illum 3
newmtl pane
Kd 1 1 1
Ni 1.5
d .1
illum 6
newmtl veil
Kd 1 1 1
d .25
illum 1
)";

// A pentagon, a square by indices that count back, lines, groups, two materials.
constexpr char house_obj[] = R"(mtllib house.mtl
o house
v 0 0 0
v 4 0 0
v 4 3 0
v 2 5 0
v 0 3 0
vt 0 0
vt 1 0
vt 1 1
g front
usemtl wall
f 1/1 2/2 3/3 4/3 5/1
g floor
usemtl varnish
v 0 0 0
v 4 0 0
v 4 0 -4
v 0 0 -4
f -4 -3 -2 -1
l 1 2 3
usemtl mirror
f 1 2 3
usemtl pane
f 2 3 4
usemtl veil
f 3 4 5
)";

struct House {
  House() {
    folder.write("house.mtl", house_mtl);
    path = folder.write("house.obj", house_obj);
  }
  TempFolder folder;
  std::string path;
};

const scenefile::MaterialEntity& material(const SceneDescription& s, const std::string& name) {
  return s.materials.at(size_t(s.named_materials.at(name)));
}
const scenefile::ShapeEntity& shape_of(const SceneDescription& s, const std::string& material) {
  for (const auto& shape : s.shapes)
    if (s.materials[size_t(shape.material)].name == material) return shape;
  throw std::runtime_error("no shape of " + material);
}
size_t triangles(const scenefile::ShapeEntity& e) {
  return e.params.get_ints("indices").size() / 3;
}

TEST(ModelScenes, ObjFilesWithMaterials) {
  const House house;
  Diagnostics diagnostics;
  const SceneDescription s = test::read(house.path, {}, &diagnostics);
  EXPECT_EQ(triangles(shape_of(s, "wall")), 3u);     // a pentagon
  EXPECT_EQ(triangles(shape_of(s, "varnish")), 2u);  // a square
  EXPECT_EQ(material(s, "wall").type, "diffuse");
  const auto* kd = material(s, "wall").params.find("reflectance");
  ASSERT_TRUE(kd);
  EXPECT_EQ(kd->numbers, (std::vector<float>{.6f, .5f, .4f}));
  EXPECT_EQ(material(s, "varnish").type, "openpbr");
  EXPECT_NEAR(material(s, "varnish").params.get_float("specular_roughness", 0), std::pow(2.0 / 202, .25), 1e-5);
  EXPECT_EQ(material(s, "mirror").type, "conductor");
  EXPECT_EQ(material(s, "pane").type, "dielectric");
  EXPECT_FLOAT_EQ(material(s, "pane").params.get_float("eta", 0), 1.5f);
  EXPECT_FALSE(shape_of(s, "pane").params.find("alpha"));
  EXPECT_EQ(material(s, "veil").type, "diffuse");
  EXPECT_FLOAT_EQ(shape_of(s, "veil").params.get_float("alpha", 1), .25f);
  // The lines are named, once.
  const auto messages = diagnostics.messages();
  EXPECT_EQ(std::count_if(messages.begin(), messages.end(),
                          [](const std::string& m) { return m.find("line") != std::string::npos; }),
            1);
}

// Numbers may begin with a point, as other programs read them.
TEST(ModelScenes, ObjFilesWithNumbersWithoutZeros) {
  const TempFolder folder;
  const std::string path = folder.write(
      "points.obj", "# .5\nv .5 0 0\r\nv\t.25 -.5 1.5\nv 0 .5 .75\nvt .5 .5\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n");
  const SceneDescription s = test::read(path);
  const auto mesh = std::find_if(s.shapes.begin(), s.shapes.end(), [](const auto& e) { return e.type != "disk"; });
  ASSERT_NE(mesh, s.shapes.end());
  EXPECT_EQ(mesh->params.find("P")->numbers, (std::vector<float>{.5f, 0, 0, .25f, -.5f, 1.5f, 0, .5f, .75f}));
}

// What has no material is .8 grey, and what has colours of vertices alone has these.
TEST(ModelScenes, ObjFilesWithoutMaterials) {
  const TempFolder folder;
  const SceneDescription grey = test::read(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_EQ(material(grey, "DefaultMaterial").params.find("reflectance")->numbers, (std::vector<float>{.8f, .8f, .8f}));
  const SceneDescription red =
      test::read(folder.write("b.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n"));
  EXPECT_EQ(material(red, "DefaultMaterial").params.find("reflectance")->numbers, (std::vector<float>{1, 0, 0}));
}

TEST(ModelScenes, HaveACameraAndALightWhereTheFileHasNone) {
  const House house;
  const SceneDescription s = test::read(house.path);
  EXPECT_EQ(s.camera.type, "perspective");
  ASSERT_EQ(s.lights.size(), 1u);
  EXPECT_EQ(s.lights[0].type, "sky");
  EXPECT_EQ(std::count_if(s.shapes.begin(), s.shapes.end(), [](const auto& e) { return e.type == "disk"; }), 1);
  ModelOptions options;
  options.view.sky = "none";
  EXPECT_TRUE(test::read(house.path, options).lights.empty());
}

// All vertices lie in the picture, and it is not mirrored: what is at larger x, seen from the front of a model whose y
// is up, is to the right.
TEST(ModelScenes, TheDefaultCameraSeesTheWhole) {
  const House house;
  for (const std::string from : {"", "front", "back", "left", "right", "above", "below"}) {
    for (const V2i& size : {V2i(160, 90), V2i(90, 160)}) {
      ModelOptions options;
      options.view.from = from;
      options.resolution = size;
      const SceneDescription s = test::read(house.path, options);
      const float fov = s.camera.params.get_float("fov", 0);
      const double tan_short = std::tan(radians(fov) / 2);
      double widest = 0;
      const auto at = [&](const V3f& p) {
        const V3f c = s.world_to_camera.start.point(p);
        EXPECT_GT(c.z, 0);
        return V2f(c.x / c.z, c.y / c.z);
      };
      for (const V3f& p :
           {V3f(0, 0, 0), V3f(4, 0, 0), V3f(4, 3, 0), V3f(2, 5, 0), V3f(0, 3, 0), V3f(4, 0, -4), V3f(0, 0, -4)}) {
        const V2f q = at(p);
        const double x = std::abs(q.x) / (tan_short * std::max(1.0, double(size.x) / size.y)),
                     y = std::abs(q.y) / (tan_short * std::max(1.0, double(size.y) / size.x));
        widest = std::max({widest, x, y});
        EXPECT_LT(x, 1) << from;
        EXPECT_LT(y, 1) << from;
      }
      EXPECT_GT(widest, .85) << from;  // a margin of 8 %
      const float across = at(V3f(4, 0, 0)).x - at(V3f(0, 0, 0)).x, upwards = at(V3f(2, 5, 0)).y - at(V3f(2, 0, 0)).y;
      const bool is_level = from != "above" && from != "below";
      EXPECT_TRUE(!(from.empty() || from == "front") || across > 0);
      EXPECT_TRUE(from != "back" || across < 0);
      EXPECT_TRUE(!is_level || upwards > 0);
    }
  }
}

TEST(ModelScenes, TwoUsesOfAMeshAreInstances) {
  const TempFolder folder;
  const std::string path = folder.write("two.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"children":[1,2,3]},{"mesh":0},{"mesh":0,"translation":[5,0,0]},{"mesh":1,"translation":[0,0,3]}],
"materials":[{"name":"red","pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"metallicFactor":0}},
{"name":"glow","emissiveFactor":[1,0.5,0]}])"));
  const SceneDescription s = test::read(path);
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.objects[0].shapes.size(), 1u);
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.instances[1].transform.expand().start.point(V3f(0, 0, 0)), V3f(5, 0, 0));
  const auto& lamp = shape_of(s, "glow");
  ASSERT_GE(lamp.area_light, 0);
  EXPECT_EQ(s.area_lights[size_t(lamp.area_light)].params.find("L")->numbers, (std::vector<float>{1, .5f, 0}));
  EXPECT_EQ(lamp.transform.start.point(V3f(0, 0, 0)), V3f(0, 0, 3));
}

TEST(ModelScenes, LightsAndCamerasOfGltf) {
  const TempFolder folder;
  const std::string path = folder.write("lit.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1,2,3]}],
"extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[
{"type":"point","name":"bulb","color":[1,0.5,0.25],"intensity":683},
{"type":"directional","name":"sun","intensity":2049}]}},
"cameras":[{"type":"perspective","name":"shot","perspective":{"yfov":0.7853981634,"aspectRatio":2,"znear":0.1}}],
"nodes":[{"mesh":0},{"name":"bulb","translation":[0,2,0],"extensions":{"KHR_lights_punctual":{"light":0}}},
{"name":"sun","extensions":{"KHR_lights_punctual":{"light":1}}},
{"name":"shot","camera":0,"translation":[0.5,0.5,3]}],
"materials":[{"name":"red"},{}])"));
  const SceneDescription s = test::read(path);
  ASSERT_EQ(s.lights.size(), 2u);
  // 683 cd are 1 W/sr, 2049 lux 3 W/m^2.
  const auto& bulb = s.lights[s.lights[0].type == "point" ? 0 : 1];
  const auto& sun = s.lights[s.lights[0].type == "point" ? 1 : 0];
  EXPECT_EQ(bulb.params.find("I")->numbers, (std::vector<float>{1, .5f, .25f}));
  EXPECT_EQ(bulb.params.get_point3("from", V3d()), V3d(0, 2, 0));
  EXPECT_FLOAT_EQ(sun.params.find("L")->numbers[0], 3);
  EXPECT_EQ(sun.params.get_point3("to", V3d()), V3d(0, 0, -1));
  EXPECT_NEAR(s.camera.params.get_float("fov", 0), 45, 1e-3);
  EXPECT_EQ(s.film.params.get_int("xresolution", 0), 1440);
  EXPECT_NEAR(s.world_to_camera.start.point(V3f(.5f, .5f, 0)).z, 3, 1e-5);
  EXPECT_GT(s.world_to_camera.start.point(V3f(1, .5f, 0)).x, 0);
  ModelOptions other;
  other.camera = "none of these";
  EXPECT_NE(test::error_of([&] { test::read(path, other); }).find("shot"), std::string::npos);
}

TEST(ModelScenes, MetalRoughnessBecomesOpenPbr) {
  const TempFolder folder;
  const std::string path = folder.write("m.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":1}],
"materials":[{"name":"half","pbrMetallicRoughness":{"metallicFactor":0.25,"roughnessFactor":0.5}},
{"name":"cut","alphaMode":"MASK","alphaCutoff":0.5,"pbrMetallicRoughness":{"metallicFactor":1,"baseColorFactor":[1,1,1,0.3]}}])"));
  const SceneDescription s = test::read(path);
  EXPECT_EQ(material(s, "half").type, "openpbr");
  EXPECT_FLOAT_EQ(material(s, "half").params.get_float("base_metalness", 0), .25f);
  EXPECT_FLOAT_EQ(material(s, "half").params.get_float("specular_roughness", 0), .5f);
  EXPECT_FLOAT_EQ(material(s, "cut").params.get_float("base_metalness", 0), 1);
  EXPECT_EQ(shape_of(s, "cut").params.get_float("alpha", 1), 0);  // below the cut-off
}

TEST(ModelScenes, ExtensionsOfGltfBecomeLayers) {
  const TempFolder folder;
  const std::string path = folder.write("m.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":1}],
"extensionsUsed":["KHR_materials_clearcoat","KHR_materials_sheen","KHR_materials_transmission"],
"materials":[{"name":"layers","pbrMetallicRoughness":{"metallicFactor":0},"extensions":{
"KHR_materials_clearcoat":{"clearcoatFactor":0.75,"clearcoatRoughnessFactor":0.125},
"KHR_materials_sheen":{"sheenColorFactor":[0.5,0.25,0],"sheenRoughnessFactor":0.25}}},
{"name":"tinted","pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0,"baseColorFactor":[1,0.5,0.25,1]},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1}}}])"));
  const SceneDescription s = test::read(path);
  const auto number = [&](const char* name, const char* parameter) {
    return material(s, name).params.get_float(parameter, -1);
  };
  EXPECT_FLOAT_EQ(number("layers", "coat_weight"), .75f);
  EXPECT_FLOAT_EQ(number("layers", "coat_roughness"), .125f);
  EXPECT_FLOAT_EQ(number("layers", "coat_darkening"), 0);
  EXPECT_FLOAT_EQ(number("layers", "fuzz_weight"), .5f);
  EXPECT_FLOAT_EQ(number("layers", "fuzz_roughness"), .25f);
  EXPECT_EQ(material(s, "layers").params.find("fuzz_color")->numbers, (std::vector<float>{1, .5f, 0}));
  EXPECT_FLOAT_EQ(number("tinted", "transmission_weight"), 1);
  EXPECT_TRUE(material(s, "tinted").params.get_bool("geometry_thin_walled", false));
  EXPECT_EQ(material(s, "tinted").params.find("transmission_color")->numbers, (std::vector<float>{1, .5f, .25f}));
}

TEST(ModelScenes, ExtensionsThatAssimpDoesNotRead) {
  const TempFolder folder;
  const std::string text = test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":1}],"extensionsUsed":["KHR_materials_iridescence","KHR_materials_transmission"],
"materials":[{"name":"soap","pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.5},"extensions":{
"KHR_materials_iridescence":{"iridescenceFactor":0.75,"iridescenceIor":1.5,"iridescenceThicknessMaximum":300},
"KHR_materials_anisotropy":{"anisotropyStrength":0.5,"anisotropyRotation":1},
"KHR_materials_specular":{"specularColorFactor":[1,0.5,0.25]},
"EXT_of_tomorrow":{}}},
{"name":"amber","pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_transmission":
{"transmissionFactor":1},"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":0.5,
"attenuationColor":[1,0.5,0.25]},"KHR_materials_dispersion":{"dispersion":0.5}}}])");
  ModelOptions options;
  options.unit = 2;
  for (const std::string& path : {folder.write("m.gltf", text), folder.write("m.glb", test::as_glb(text))}) {
    Diagnostics diagnostics;
    const SceneDescription s = test::read(path, options, &diagnostics);
    const auto number = [&](const char* name, const char* parameter) {
      return material(s, name).params.get_float(parameter, -1);
    };
    EXPECT_FLOAT_EQ(number("soap", "thin_film_weight"), .75f);
    EXPECT_FLOAT_EQ(number("soap", "thin_film_thickness"), .3f);
    EXPECT_FLOAT_EQ(number("soap", "thin_film_ior"), 1.5f);
    EXPECT_EQ(material(s, "soap").params.find("specular_color")->numbers, (std::vector<float>{1, .5f, .25f}));
    // glTF's alphas are .25 across and .25 + .75 / 4 along; the material's are narrow times wide, and wide.
    const float narrow = 1 - number("soap", "specular_roughness_anisotropy"),
                wide = sqr(number("soap", "specular_roughness")) * std::sqrt(2 / (1 + sqr(narrow)));
    EXPECT_NEAR(wide, .4375f, 1e-4f);
    EXPECT_NEAR(narrow * wide, .25f, 1e-4f);
    EXPECT_FLOAT_EQ(number("amber", "transmission_depth"), 1);  // half of a unit of two metres
    EXPECT_EQ(material(s, "amber").params.find("transmission_color")->numbers, (std::vector<float>{1, .5f, .25f}));
    std::string all;
    for (const std::string& m : diagnostics.messages()) all += m;
    EXPECT_FLOAT_EQ(number("amber", "transmission_dispersion_abbe_number"), 40);
    for (const char* lacking : {"direction of anisotropy", "EXT_of_tomorrow"})
      EXPECT_NE(all.find(lacking), std::string::npos) << lacking << ": " << all;
  }
}

TEST(ModelScenes, SpecularOfGltfIsThatOfDielectrics) {
  const TempFolder folder;
  const std::string path = folder.write("m.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"mesh":0},{"mesh":1}],
"materials":[{"name":"matt","pbrMetallicRoughness":{"metallicFactor":0.25},"extensions":{
"KHR_materials_specular":{"specularFactor":0},"KHR_materials_emissive_strength":{"emissiveStrength":8}},
"emissiveFactor":[1,0.5,0.25]},
{"name":"bright","pbrMetallicRoughness":{"metallicFactor":0},"extensions":{
"KHR_materials_specular":{"specularColorFactor":[4,2,1]}}}])"));
  Diagnostics diagnostics;
  const SceneDescription s = test::read(path, {}, &diagnostics);
  const auto number = [&](const char* name, const char* parameter, float usual) {
    return material(s, name).params.get_float(parameter, usual);
  };
  // A quarter is metal, whose reflection stays.
  EXPECT_EQ(material(s, "matt").type, "mix");
  EXPECT_FLOAT_EQ(number("matt", "amount", 0), .25f);
  EXPECT_FLOAT_EQ(number("matt base", "specular_weight", 1), 0);
  EXPECT_FLOAT_EQ(number("matt base", "base_metalness", 0), 0);
  EXPECT_FLOAT_EQ(number("matt metal", "specular_weight", 1), 1);
  EXPECT_FLOAT_EQ(number("matt metal", "base_metalness", 0), 1);
  EXPECT_EQ(s.area_lights.at(0).params.find("L")->numbers, (std::vector<float>{8, 4, 2}));
  // 4 % times 4 are 16 %, which an index of 1.4 / .6 mirrors.
  EXPECT_FLOAT_EQ(number("bright", "specular_ior", 1.5f), 1.4f / .6f);
  EXPECT_EQ(material(s, "bright").params.find("specular_color")->numbers, (std::vector<float>{1, .5f, .25f}));
}

// 50 % are more than openpbr's largest index mirrors, so that what is dimmer keeps what it should have: 25 %.
TEST(ModelScenes, SpecularOfGltfEndsWithTheLargestIndex) {
  const TempFolder folder;
  const std::string path = folder.write("m.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],
"materials":[{"name":"brighter","pbrMetallicRoughness":{"metallicFactor":0},"extensions":{
"KHR_materials_specular":{"specularColorFactor":[12.5,6.25,0]}}},{}])"));
  Diagnostics diagnostics;
  const SceneDescription s = test::read(path, {}, &diagnostics);
  EXPECT_FLOAT_EQ(material(s, "brighter").params.get_float("specular_ior", 1.5f), 3);
  EXPECT_EQ(material(s, "brighter").params.find("specular_color")->numbers, (std::vector<float>{1, 1, 0}));
  int named = 0;
  for (const std::string& m : diagnostics.messages()) named += m.find("more than a quarter") != std::string::npos;
  EXPECT_EQ(named, 1);
}

// Names need not be there, nor differ.
TEST(ModelScenes, ExtensionsGoByTheOrderOfMaterials) {
  const TempFolder folder;
  const std::string text = test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0,1,2]}],
"nodes":[{"mesh":0},{"mesh":1},{"mesh":0}],
"materials":[{},{"extensions":{"KHR_materials_iridescence":{"iridescenceFactor":0.5}}}])");
  Diagnostics diagnostics;
  const SceneDescription s = test::read(folder.write("m.gltf", text), {}, &diagnostics);
  int with_film = 0;
  for (const auto& m : s.materials) with_film += m.params.get_float("thin_film_weight", 0) == .5f;
  EXPECT_EQ(with_film, 1);
  for (const std::string& m : diagnostics.messages()) EXPECT_EQ(m.find("its name"), std::string::npos) << m;
}

// Clear thin glass is a plain pane, but not with a film on it.
TEST(ModelScenes, SoapBubblesKeepTheirFilm) {
  const TempFolder folder;
  const auto read = [&](const std::string& more) {
    const std::string text = test::triangle_gltf(
        R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"extensionsUsed":["KHR_materials_transmission"],
"materials":[{"name":"bubble","pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0},"extensions":{
"KHR_materials_transmission":{"transmissionFactor":1})" +
        more + "}},{}]");
    return test::read(folder.write("m.gltf", text));
  };
  EXPECT_EQ(material(read(""), "bubble").type, "thindielectric");
  const SceneDescription s = read(R"(,"KHR_materials_iridescence":{"iridescenceFactor":1})");
  EXPECT_EQ(material(s, "bubble").type, "openpbr");
  EXPECT_FLOAT_EQ(material(s, "bubble").params.get_float("thin_film_weight", 0), 1);
}

TEST(ModelScenes, AnimationAtATimeAndItsBlur) {
  const TempFolder folder;
  const std::string path = folder.write("moves.gltf", test::triangle_gltf(R"("scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"n","mesh":0}],"materials":[{"name":"red"},{}],
"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],
"samplers":[{"input":2,"output":3,"interpolation":"LINEAR"}]}])"));
  const auto x = [&](double open, double shutter, bool end) {
    ModelOptions options;
    options.time = {open, shutter};
    const auto t = test::read(path, options).shapes.at(0).transform;
    return (end ? t.end : t.start).point(V3f(0, 0, 0)).x;
  };
  EXPECT_NEAR(x(-1, 0, false), 0, 1e-5);
  EXPECT_NEAR(x(.25, 0, false), 1, 1e-4);
  EXPECT_NEAR(x(.25, 0, true), 1, 1e-4);
  EXPECT_NEAR(x(.25, .5, true), 3, 1e-4);
  EXPECT_NEAR(x(9, 0, false), 4, 1e-4);
}

TEST(ModelScenes, UpAndUnit) {
  const TempFolder folder;
  const std::string path = folder.write("t.stl",
                                        "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\n"
                                        "vertex 0 2 1\nendloop\nendfacet\nendsolid t\n");
  const auto up_of = [](const SceneDescription& s) {
    return s.world_to_camera.start.vector(V3f(0, 0, 1)).y;  // of z, in the picture
  };
  EXPECT_GT(up_of(test::read(path)), .9f);  // z is up in STL
  ModelOptions options;
  options.view.up = "-z";
  EXPECT_LT(up_of(test::read(path, options)), -.9f);
  options = {};
  options.unit = .001;
  const SceneDescription s = test::read(path, options);
  EXPECT_NEAR(s.shapes.at(0).transform.start.point(V3f(2, 0, 0)).x, .002f, 1e-9f);
}

TEST(ModelScenes, ImportInScenes) {
  const House house;
  const std::string scene = house.folder.write("scene.pbrt", R"(Camera "perspective"
WorldBegin
MakeNamedMaterial "wall" "string type" "conductor"
AttributeBegin
Translate 10 0 0
Import "house.obj"
AttributeEnd
ObjectBegin "o"
Import "house.obj"
ObjectEnd
)");
  const SceneDescription s = test::read(scene);
  EXPECT_EQ(material(s, "wall").type, "conductor");
  EXPECT_EQ(material(s, "house.obj/wall").type, "diffuse");
  EXPECT_EQ(shape_of(s, "house.obj/wall").transform.start.point(V3f(0, 0, 0)).x, 10);
  EXPECT_EQ(s.objects.at(0).shapes.size(), 5u);
  EXPECT_TRUE(s.lights.empty());
  EXPECT_NE(test::error_of([&] {
              test::read(house.folder.write("b.pbrt", "WorldBegin\nImport \"no.glb\"\n"));
            }).find("b.pbrt:2:1"),
            std::string::npos);
}

TEST(ModelScenes, BadFilesAreInputErrors) {
  const TempFolder folder;
  for (const auto& [name, text] : {std::pair<const char*, std::string>{"empty.glb", ""},
                                   {"text.fbx", "no model"},
                                   {"cut.gltf", test::triangle_gltf("\"nodes\":[]").substr(0, 300)},
                                   {"empty.obj", "# nothing\n"},
                                   {"points.obj", "v 0 0 0\nv 1 0 0\np 1\n"},
                                   {"bad.obj", "v 0 0 0\nf 1 2 3\n"},
                                   {"bad.stl", "solid"}}) {
    const std::string path = folder.write(name, text);
    EXPECT_NE(test::error_of([&] { test::read(path); }).find(name), std::string::npos) << name;
  }
  EXPECT_NE(test::error_of([&] { test::read(folder.path() + "/none.glb"); }).find("none.glb"), std::string::npos);
}

TEST(ModelScenes, MissingPicturesAreNamed) {
  const TempFolder folder;
  folder.write("m.mtl", "newmtl a\nKd .5 .5 .5\nmap_Kd C:\\\\maps\\\\wood.png\n");
  const std::string path = folder.write("m.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
  Diagnostics diagnostics;
  const SceneDescription s = test::read(path, {}, &diagnostics);
  EXPECT_EQ(diagnostics.messages().size(), 1u);
  EXPECT_FALSE(material(s, "a").params.find("reflectance", scenefile::ParamType::texture));
}

}  // namespace
}  // namespace dapple::modelfile
