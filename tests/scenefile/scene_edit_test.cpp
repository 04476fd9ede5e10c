// SPDX-License-Identifier: Apache-2.0
// Edit, Remove and DicingCamera: what they do to a description, and that what is wrong leaves it as it was.
#include "dapple/scenefile/scene_edit.h"

#include <gtest/gtest.h>

#include "dapple/scenefile/scene_text.h"

namespace dapple::scenefile {
namespace {

constexpr const char* room = R"(
LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 20 "integer yresolution" 10
WorldBegin
LightSource "point" "string name" "key" "rgb I" [1 1 1]
LightSource "point" "rgb I" [2 2 2]
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [.8 .1 .1]
MakeNamedMaterial "mirror" "string type" "conductor"
NamedMaterial "red"
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [4 4 4] "string name" "lamp"
  Shape "sphere" "string name" "bulb"
AttributeEnd
Shape "sphere" "float radius" 2
Material "diffuse"
Shape "disk" "string name" "chair"
Shape "disk" "string name" "chair"
ObjectBegin "tree"
  Shape "sphere"
ObjectEnd
ObjectInstance "tree"
Translate 1 0 0
ObjectInstance "tree" "string name" "the other"
Identity
)";

class Edits : public testing::Test {
 protected:
  Edits() : text(diagnostics) { text.read_text(room, "room", ""); }
  SceneDescription& d() { return text.description(); }
  void add(const std::string& more) { text.add(more, "edit"); }
  void expect_error(const std::string& more, const std::string& message) {
    const auto before = text.builder().checkpoint();
    try {
      add(more);
      FAIL() << "no error for " << more;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("edit:"), std::string::npos) << error.what();
    }
    text.builder().restore(*before);
  }

  Diagnostics diagnostics;
  SceneText text;
};

TEST_F(Edits, NamesAreThoseOfTheUserElseTypeAndNumber) {
  SceneEditor& e = text.builder().editor();
  using V = std::vector<std::string>;
  EXPECT_EQ(e.names(EditTarget::light), (V{"key", "point:2", "lamp"}));
  EXPECT_EQ(e.names(EditTarget::shape), (V{"bulb", "sphere:2", "chair", "tree/sphere:1"}));
  EXPECT_EQ(e.names(EditTarget::object), (V{"tree:1", "the other"}));
  EXPECT_EQ(e.names(EditTarget::material), (V{"red", "mirror", "diffuse:1"}));
}

TEST_F(Edits, SetParametersInPlace) {
  add(R"(Edit "light" "key" "rgb I" [3 0 0] "float scale" 2   Edit "light" "lamp" "blackbody L" 3000
         Edit "material" "red" "string type" "conductor" "float roughness" .1
         Edit "camera" "float fov" 20  Edit "film" "integer xresolution" 40
         Edit "integrator" "string type" "path" "integer maxdepth" 3)");
  EXPECT_EQ(d().lights[0].params.get_float("scale", 1), 2);
  EXPECT_EQ(d().lights[0].params.find("I")->numbers[0], 3);
  EXPECT_EQ(d().lights[1].params.find("I")->numbers[0], 2);
  EXPECT_EQ(d().area_lights[0].params.find("L")->type, ParamType::blackbody);
  EXPECT_EQ(d().materials[size_t(d().named_materials.at("red"))].type, "conductor");
  EXPECT_EQ(d().camera.params.get_float("fov", 0), 20);
  EXPECT_EQ(d().film.params.get_int("xresolution", 0), 40);
  EXPECT_EQ(d().integrator.type, "path");
}

TEST_F(Edits, EmptyValuesTakeOut) {
  add(R"(Edit "light" "key" "rgb I" [])");
  EXPECT_EQ(d().lights[0].params.find("I"), nullptr);
}

TEST_F(Edits, PlaceThings) {
  // "move" is applied after what is there, in the world; a name may be that of several things.
  add(R"(Edit "shape" "chair" "float move" [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1]
         Edit "object" "tree" "float move" [1 0 0 0  0 1 0 0  0 0 1 0  0 0 3 1]
         Edit "object" "tree:1" "bool visible" false
         Edit "light" "key" "float transform" [1 0 0 0  0 1 0 0  0 0 1 0  1 2 3 1]
         Edit "camera" "float lookat" [0 0 5  0 0 0  0 1 0])");
  EXPECT_EQ(d().shapes[2].transform.start.point(V3f(0)), V3f(5, 6, 7));
  EXPECT_EQ(d().shapes[3].transform.end.point(V3f(0)), V3f(5, 6, 7));
  EXPECT_EQ(d().instances[1].transform.exact().start.point(V3f(0)), V3f(1, 0, 3));
  EXPECT_FALSE(d().instances[0].is_shown());
  EXPECT_TRUE(d().instances[1].is_shown());
  EXPECT_EQ(d().lights[0].transform.start.point(V3f(0)), V3f(1, 2, 3));
  EXPECT_EQ(d().world_to_camera.start.point(V3f(0, 0, 5)), V3f(0));
}

TEST_F(Edits, RemovedThingsLeaveTheNamesOfOthers) {
  add(R"(Remove "light" "key"  Remove "shape" "chair")");
  EXPECT_EQ(text.builder().editor().names(EditTarget::light), (std::vector<std::string>{"point:2", "lamp"}));
  EXPECT_FALSE(d().lights[0].is_shown());
  expect_error(R"(Remove "light" "key")", "no light is called \"key\"");
  add(R"(Edit "shape" "bulb" "bool visible" false)");
  EXPECT_FALSE(d().shapes[0].is_shown());
  add(R"(Edit "light" "lamp" "bool on" false)");
  EXPECT_FALSE(d().emits(d().shapes[0]));
}

TEST_F(Edits, ShapesOfDefinitionsThatAreNamedBefore) {
  add(R"(ObjectBegin "bough" ObjectInstance "leaf" ObjectEnd
ObjectBegin "twig" Shape "sphere" ObjectEnd
Edit "shape" "twig/sphere:1" "float radius" 2
ObjectBegin "leaf" Shape "sphere"
Edit "shape" "leaf/sphere:1" "float radius" 3
Shape "sphere"
ObjectEnd
Edit "shape" "leaf/sphere:2" "float radius" 4)");
  const auto& shapes = d().objects[size_t(d().named_objects.at("leaf"))].shapes;
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].params.get_float("radius", 1), 3);
  EXPECT_EQ(shapes[1].params.get_float("radius", 1), 4);
}

TEST_F(Edits, Materials) {
  add(R"(Edit "shape" "chair" "string material" "mirror")");
  EXPECT_EQ(d().materials[size_t(d().shapes[3].material)].name, "mirror");
  expect_error(R"(Edit "shape" "chair" "string material" "wood")", "no material is called \"wood\"");
  expect_error(R"(Edit "material" "diffuse:1" "string type" "conductor")", "only materials that have a name");
}

TEST_F(Edits, ErrorsLeaveEverythingAsItWas) {
  expect_error(R"(Edit "light" "kay" "float scale" 2)", "expected one of: key");
  expect_error(R"(Edit "lamp" "key" "float scale" 2)", "unknown target");
  expect_error(R"(Edit "light" "key" "float transform" [1 2 3])", "16 numbers");
  expect_error(R"(Edit "shape" "bulb" "float move" [0 0 0 0  0 0 0 0  0 0 0 0  0 0 0 1])", "singular");
  expect_error(R"(Edit "object" "tree:1" "float transform" [1 0 0 1  0 1 0 0  0 0 1 0  0 0 0 1])", "affine");
  expect_error(R"(Edit "object" "tree:1" "float radius" 2)", "no parameter \"radius\"");
  expect_error(R"(Edit "light" "lamp" "float move" [1 0 0 0  0 1 0 0  0 0 1 0  5 6 7 1])", "moves with its shapes");
  expect_error(R"(Edit "light" "key" "string name" "fill")", "cannot change the name");
  expect_error(R"(Edit "light" "key" "float scale" nan)", "not a finite number");
  expect_error(R"(Edit "light" "key" "bool on" 1)", "true or false");
  expect_error(R"(Remove "material" "red")", "Remove takes lights, shapes and objects");
  expect_error(R"(Remove "light" "key" "float scale" 2)", "Remove takes no parameters");
  // What came before the mistake is taken back, in all its kinds.
  expect_error(R"(Edit "light" "key" "float scale" 2 "rgb I" []  Remove "light" "point:2"
                  Edit "camera" "float fov" 5 "float lookat" [0 0 5  0 0 0  0 1 0]  Edit "object" "tree" "bool visible" false
                  LightSource "distant"  Shape "disk"  MakeNamedMaterial "new" "string type" "diffuse"  DicingCamera
                  ObjectInstance "tree" "string name" "third"  AttributeBegin  Option "string folder" "x"  Edit "shape" "none" "float radius" 1)",
               "no shape is called");
  EXPECT_EQ(d().lights.size(), 2u);
  EXPECT_EQ(d().lights[0].params.find("scale"), nullptr);
  EXPECT_EQ(d().lights[0].params.find("I")->numbers[0], 1);
  EXPECT_TRUE(d().lights[1].is_shown());
  EXPECT_EQ(d().camera.params.get_float("fov", 0), 40);
  EXPECT_EQ(d().world_to_camera.start.point(V3f(0, 0, -5)), V3f(0));
  EXPECT_EQ(d().shapes.size(), 4u);
  EXPECT_EQ(d().instances.size(), 2u);
  EXPECT_TRUE(d().instances[0].is_shown());
  EXPECT_FALSE(d().named_materials.contains("new"));
  EXPECT_FALSE(d().dicing_camera);
  EXPECT_EQ(d().base_directory, "");
  add(R"(Edit "light" "key" "float scale" 4)");
  EXPECT_EQ(d().lights[0].params.get_float("scale", 1), 4);
}

TEST_F(Edits, GroupsOfLights) {
  using enum EditTarget;
  const auto gain = [&](const char* group) {
    return text.builder().editor().parameter(EditTarget::group, group, "gain");
  };
  EXPECT_EQ(text.builder().editor().names(group), std::vector<std::string>{"default"});
  add(R"(LightGroup "set" "float gain" 2  Edit "light" "key" "string group" "front"
         Attribute "light" "string group" "back"  LightSource "point" "string name" "third")");
  EXPECT_EQ(text.builder().editor().names(group), (std::vector<std::string>{"default", "front", "back", "set"}));
  EXPECT_EQ(gain("front"), nullptr);
  add(R"(Edit "group" "front" "rgb gain" [1 2 3]  Edit "group" "default" "float gain" .5  LightGroup "set" "float gain" 4)");
  EXPECT_EQ(gain("front")->numbers, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(gain("default")->numbers[0], .5f);
  EXPECT_EQ(gain("set")->numbers[0], 4);
  expect_error(
      R"(Edit "group" "front" "float gain" 7  LightGroup "set" "float gain" []  LightGroup "new" "float gain" 1  Edit "group" "side" "float gain" 1)",
      "no group is called \"side\"");
  EXPECT_EQ(gain("front")->numbers, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(gain("set")->numbers[0], 4);
  EXPECT_EQ(text.builder().editor().names(group), (std::vector<std::string>{"default", "front", "back", "set"}));
  add(R"(Edit "group" "front" "rgb gain" []  Remove "light" "key")");
  EXPECT_EQ(text.builder().editor().names(group), (std::vector<std::string>{"default", "back", "set"}));
  expect_error(R"(Edit "group" "set" "float scale" 2)", "expected gain");
  expect_error(R"(LightGroup "set" "float power" 2)", "expected gain");
  expect_error(R"(Remove "group" "set")", "Remove takes lights");
  std::string many;
  for (int i = 0; i < 300; ++i) many += "LightGroup \"g" + std::to_string(i) + "\" \"float gain\" 2\n";
  expect_error(many, "one too many");
}

TEST_F(Edits, TheDicingCameraStaysWhereItWas) {
  add(R"(DicingCamera  Edit "camera" "float fov" 5  Edit "film" "integer xresolution" 99)");
  ASSERT_TRUE(d().dicing_camera);
  EXPECT_EQ(d().dicing_camera->camera.params.get_float("fov", 0), 40);
  EXPECT_EQ(d().dicing_camera->film.params.get_int("xresolution", 0), 20);
}

// Names are found by an index: that many edits of that many items take no time.
TEST_F(Edits, ManyItemsAndManyEdits) {
  std::string many;
  for (int i = 0; i < 20000; ++i) many += "Shape \"cylinder\"\n";
  for (int i = 1; i <= 20000; ++i) many += "Edit \"shape\" \"cylinder:" + std::to_string(i) + "\" \"float radius\" 2\n";
  add(many);
  EXPECT_EQ(d().shapes.back().params.get_float("radius", 0), 2);
  // But many edits of many things of one name are bounded.
  many.clear();
  for (int i = 0; i < 20000; ++i) many += "Shape \"cylinder\" \"string name\" \"all\"\n";
  for (int i = 1; i <= 5000; ++i) many += "Edit \"shape\" \"all\" \"float radius\" 2\n";
  expect_error(many, "implausibly many edits");
}

}  // namespace
}  // namespace dapple::scenefile
