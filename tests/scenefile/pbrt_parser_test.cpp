// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dapple/base/timer.h"
#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::parse;
using test::parse_error;
using test::parse_world;

std::string world_error(const std::string& text) {
  return parse_error("WorldBegin " + text);
}

TEST(PbrtParser, EveryOptionsDirective) {
  const auto s = parse(R"(
Option "disablepixeljitter" true
Option "seed" 7
Option "displacement_edge_scale" 1.5
Option "msereferenceimage" "ref.exr"
ColorSpace "rec2020"
TransformTimes 0.5 2
LookAt 3 4 5  0 0 0  0 0 1
MediumInterface "" "fog"
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" [ 16 ] "string filename" "o.exr"
Sampler "halton" "integer pixelsamples" 4
PixelFilter "box"
Integrator "path" "integer maxdepth" 3
Accelerator "bvh"
MakeNamedMedium "fog" "string type" "homogeneous"
WorldBegin)");
  EXPECT_TRUE(s.options.get_bool("disablepixeljitter", false));
  EXPECT_EQ(s.options.get_int("seed", 0), 7);
  EXPECT_EQ(s.options.get_float("displacementedgescale", 0), 1.5f);
  EXPECT_EQ(s.options.get_string("msereferenceimage", ""), "ref.exr");
  EXPECT_EQ(s.color_space.type, "rec2020");
  EXPECT_EQ(s.shutter_start_transform_time, 0.5);
  EXPECT_EQ(s.shutter_end_transform_time, 2);
  EXPECT_EQ(s.camera.type, "perspective");
  EXPECT_EQ(s.camera.params.get_float("fov", 0), 40);
  EXPECT_EQ(s.camera_medium, "fog");
  EXPECT_NEAR(length(s.world_to_camera.start.point({3, 4, 5})), 0, 1e-5);
  EXPECT_EQ(s.film.params.get_int("xresolution", 0), 16);
  EXPECT_EQ(s.sampler.type, "halton");
  EXPECT_EQ(s.pixel_filter.type, "box");
  EXPECT_EQ(s.integrator.params.get_int("maxdepth", 0), 3);
  EXPECT_EQ(s.accelerator.type, "bvh");
  EXPECT_EQ(s.film.loc.line, 11u);
  EXPECT_EQ(s.film.loc.column, 1u);
  EXPECT_EQ(s.film.loc.file, "test.pbrt");
}

TEST(PbrtParser, EveryWorldDirective) {
  const auto s = parse_world(R"(
Texture "t" "spectrum" "checkerboard" "float uscale" 4
Texture "t" "float" "constant"
Material "conductor" "spectrum eta" "metal-Au-eta"
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 1 0 0 ]
MakeNamedMedium "air" "string type" "homogeneous"
LightSource "point" "blackbody I" 4500
AttributeBegin
  AreaLightSource "diffuse" "spectrum L" [ 400 1 700 2 ]
  MediumInterface "air" ""
  ReverseOrientation
  NamedMaterial "red"
  Translate 1 2 3
  Shape "sphere" "float radius" 2
AttributeEnd
Shape "disk"
ObjectBegin "thing"
  Shape "cylinder"
ObjectEnd
ObjectInstance "thing"
CoordinateSystem "here"
Translate 5 5 5
CoordSysTransform "here"
Identity
)");
  ASSERT_EQ(s.shapes.size(), 2u);
  const ShapeEntity& sphere = s.shapes[0];
  EXPECT_EQ(sphere.type, "sphere");
  EXPECT_TRUE(sphere.reverse_orientation);
  EXPECT_EQ(sphere.material, s.named_materials.at("red"));
  EXPECT_EQ(sphere.inside_medium, "air");
  EXPECT_EQ(sphere.outside_medium, "");
  EXPECT_EQ(sphere.transform.start.point({0, 0, 0}), V3f(1, 2, 3));
  EXPECT_FALSE(sphere.transform.is_animated());
  ASSERT_EQ(sphere.area_light, 0);
  EXPECT_EQ(s.area_lights[0].params.find("L")->numbers, (std::vector<float>{400, 1, 700, 2}));
  const ShapeEntity& disk = s.shapes[1];
  EXPECT_FALSE(disk.reverse_orientation);
  EXPECT_EQ(disk.area_light, -1);
  EXPECT_EQ(s.materials[size_t(disk.material)].type, "conductor");
  EXPECT_EQ(s.materials[size_t(disk.material)].params.find("eta")->strings[0], "metal-Au-eta");
  EXPECT_EQ(s.materials[0].type, "diffuse");
  EXPECT_EQ(s.materials[size_t(sphere.material)].type, "diffuse");
  EXPECT_EQ(s.materials[size_t(sphere.material)].name, "red");
  EXPECT_TRUE(s.textures[size_t(s.spectrum_textures.at("t"))].is_spectrum);
  EXPECT_FALSE(s.textures[size_t(s.float_textures.at("t"))].is_spectrum);
  EXPECT_EQ(s.lights.at(0).params.find("I")->type, ParamType::blackbody);
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.objects[0].shapes.at(0).type, "cylinder");
  ASSERT_EQ(s.instances.size(), 1u);
  EXPECT_EQ(s.instances[0].object, s.named_objects.at("thing"));
}

TEST(PbrtParser, EveryParameterType) {
  const auto s = parse_world(R"(Shape "x"
    "bool b1" true "bool b2" [ "false" ] "bool b3" [ true false ]
    "integer i" [ 1 -2 ] "float f" 1.5 "point2 p2" [ 1 2 ] "vector2 v2" [ 3 4 ]
    "point3 p3" [ 1 2 3 ] "point p" [ 1 2 3 ] "vector3 v3" [ 1 2 3 ] "vector v" [ 4 5 6 ]
    "normal n" [ 0 0 1 ] "normal3 n3" [ 0 1 0 ] "string s" "text" "string ss" [ "a" "b" ] "texture t" "tex"
    "rgb c" [ .1 .2 .3 ] "blackbody k" 3000 "spectrum sp" [ 400 1 500 2 ] "spectrum sn" "glass-BK7"
    "  float   spaced  " 2 "float empty" [ ])");
  const ParamSet& p = s.shapes[0].params;
  EXPECT_TRUE(p.get_bool("b1", false));
  EXPECT_FALSE(p.get_bool("b2", true));
  EXPECT_EQ(p.find("b3")->integers, (std::vector<int32_t>{1, 0}));
  EXPECT_EQ(p.find("i")->integers, (std::vector<int32_t>{1, -2}));
  EXPECT_EQ(p.get_float("f", 0), 1.5f);
  EXPECT_EQ(p.get_point2("p2", {}), V2f(1, 2));
  EXPECT_EQ(p.find("v2")->type, ParamType::vector2);
  EXPECT_EQ(p.get_point3("p3", V3d(0)), V3d(1, 2, 3));
  EXPECT_EQ(p.get_point3("p", V3d(0)), V3d(1, 2, 3));
  EXPECT_EQ(p.get_vector3("v3", {}), V3f(1, 2, 3));
  EXPECT_EQ(p.get_vector3("v", {}), V3f(4, 5, 6));
  EXPECT_EQ(p.get_normals("n").size(), 3u);
  EXPECT_EQ(p.get_normals("n3")[1], 1);
  EXPECT_EQ(p.get_string("s", ""), "text");
  EXPECT_EQ(p.get_strings("ss").size(), 2u);
  EXPECT_EQ(p.find("t", ParamType::texture)->strings[0], "tex");
  EXPECT_EQ(p.find("c", ParamType::rgb)->numbers[1], .2f);
  EXPECT_EQ(p.find("k", ParamType::blackbody)->numbers[0], 3000);
  EXPECT_EQ(p.find("sp", ParamType::spectrum)->numbers.size(), 4u);
  EXPECT_EQ(p.find("sn", ParamType::spectrum)->strings[0], "glass-BK7");
  EXPECT_EQ(p.get_float("spaced", 0), 2);
  EXPECT_TRUE(p.get_floats("empty").empty());
  EXPECT_EQ(p.find("f")->loc.line, 3u);
  EXPECT_EQ(p.find("f")->loc.column, 26u);
}

TEST(PbrtParser, MatricesAreReadByColumns) {
  const auto s = parse_world(
      "Scale 2 2 2 Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  7 8 9 1 ] Shape \"a\" "
      "ConcatTransform [ 2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 1 ] Shape \"b\"");
  EXPECT_EQ(s.shapes[0].transform.start.point({0, 0, 0}), V3f(7, 8, 9));
  EXPECT_EQ(s.shapes[1].transform.start.point({1, 1, 1}), V3f(9, 10, 11));
}

TEST(PbrtParser, TransformsApplyInnermostLast) {
  const auto s = parse_world("Translate 1 0 0 Rotate 90 0 0 1 Scale 2 1 1 Shape \"a\"");
  const V3f p = s.shapes[0].transform.start.point({1, 0, 0});
  EXPECT_NEAR(length(p - V3f(1, 2, 0)), 0, 1e-6);
}

TEST(PbrtParser, ActiveTransformMovesOneEndOnly) {
  const auto s = parse_world(
      "ActiveTransform EndTime Translate 1 0 0 Shape \"a\" "
      "ActiveTransform StartTime Translate 0 1 0 Shape \"b\" ActiveTransform All Translate 0 0 1 Shape \"c\"");
  EXPECT_TRUE(s.shapes[0].transform.is_animated());
  EXPECT_EQ(s.shapes[0].transform.start.point({0, 0, 0}), V3f(0, 0, 0));
  EXPECT_EQ(s.shapes[0].transform.end.point({0, 0, 0}), V3f(1, 0, 0));
  EXPECT_EQ(s.shapes[1].transform.start.point({0, 0, 0}), V3f(0, 1, 0));
  EXPECT_EQ(s.shapes[2].transform.end.point({0, 0, 0}), V3f(1, 0, 1));
}

TEST(PbrtParser, WorldBeginResetsTheTransformAndCameraNamesACoordinateSystem) {
  const auto s =
      parse("Translate 0 0 -5 Camera \"perspective\" WorldBegin Shape \"a\" CoordSysTransform \"camera\" Shape \"b\"");
  EXPECT_EQ(s.shapes[0].transform.start.point({0, 0, 0}), V3f(0, 0, 0));
  EXPECT_EQ(s.shapes[1].transform.start.point({0, 0, 0}), V3f(0, 0, 5));
}

TEST(PbrtParser, InstancesCarryTheTransformOfTheirPlace) {
  const auto s = parse_world(
      "AttributeBegin Translate 1 0 0 ObjectBegin \"o\" Translate 0 1 0 Shape \"a\" ObjectEnd "
      "ObjectInstance \"o\" AttributeEnd Scale 3 3 3 ObjectInstance \"o\"");
  EXPECT_EQ(s.objects[0].shapes[0].transform.start.point({0, 0, 0}), V3f(1, 1, 0));
  EXPECT_EQ(s.instances[0].transform.expand().start.point({0, 0, 0}), V3f(1, 0, 0));
  EXPECT_EQ(s.instances[1].transform.expand().start.point({1, 0, 0}), V3f(3, 0, 0));
  EXPECT_TRUE(s.shapes.empty());
}

TEST(PbrtParser, AttributesGiveDefaults) {
  const auto s = parse_world(R"(Attribute "shape" "float radius" 5 "float alpha" .5
AttributeBegin
Attribute "shape" "float radius" 6
Shape "sphere"
Shape "sphere" "float radius" 7
AttributeEnd
Shape "sphere"
Attribute "material" "string type" "conductor"
MakeNamedMaterial "m"
Attribute "light" "float scale" 3
LightSource "point"
Attribute "texture" "float scale" 4
Texture "t" "float" "scale"
Attribute "medium" "string type" "cloud"
MakeNamedMedium "c")");
  EXPECT_EQ(s.shapes[0].params.get_float("radius", 1), 6);
  EXPECT_EQ(s.shapes[0].params.get_float("alpha", 1), .5f);
  EXPECT_EQ(s.shapes[1].params.get_float("radius", 1), 7);
  EXPECT_EQ(s.shapes[2].params.get_float("radius", 1), 5);
  EXPECT_EQ(s.materials[size_t(s.named_materials.at("m"))].type, "conductor");
  EXPECT_EQ(s.lights[0].params.get_float("scale", 1), 3);
  EXPECT_EQ(s.textures[0].params.get_float("scale", 1), 4);
  EXPECT_EQ(s.media[0].type, "cloud");
  EXPECT_CONTAINS(world_error("Attribute \"shapes\" \"float a\" 1"),
                  "unknown target \"shapes\"; expected one of: shape");
}

TEST(PbrtParser, ColorSpaceIsPartOfTheAttributes) {
  const auto s = parse(
      "WorldBegin AttributeBegin ColorSpace \"aces2065-1\" Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ] "
      "AttributeEnd Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]");
  EXPECT_EQ(s.materials[1].params.find("reflectance")->color_space, ColorSpace::aces2065_1);
  EXPECT_EQ(s.materials[2].params.find("reflectance")->color_space, ColorSpace::srgb);
  EXPECT_NE(world_error("ColorSpace \"cmyk\""), "");
}

TEST(PbrtParser, NamesMayBeUsedBeforeTheirDefinition) {
  const auto s = parse_world(
      "NamedMaterial \"late\" Shape \"a\" ObjectInstance \"o\" MediumInterface \"m\" \"\" "
      "MakeNamedMaterial \"late\" \"string type\" \"mix\" ObjectBegin \"o\" ObjectEnd "
      "MakeNamedMedium \"m\" \"string type\" \"cloud\"");
  EXPECT_EQ(s.materials[size_t(s.shapes[0].material)].type, "mix");
  EXPECT_EQ(s.instances[0].object, 0);
}

TEST(PbrtParser, SilentFileKeepsDefaults) {
  const auto s = parse("WorldBegin");
  EXPECT_TRUE(s.camera.type.empty());
  EXPECT_TRUE(s.world_to_camera.start.is_identity());
  EXPECT_EQ(s.shutter_end_transform_time, 1);
  EXPECT_EQ(s.materials.size(), 1u);
}

struct BadScene {
  const char* text;
  const char* place;    ///< "line:column"
  const char* message;  ///< part of it
};

class PbrtParserErrors : public testing::TestWithParam<BadScene> {};

TEST_P(PbrtParserErrors, NameThePlaceAndTheFault) {
  const std::string message = parse_error(GetParam().text);
  EXPECT_EQ(message.find(std::string("test.pbrt:") + GetParam().place + ":"), 0u) << message;
  EXPECT_CONTAINS(message, GetParam().message);
}

const BadScene bad_scenes[] = {
    {"", "1:1", "WorldBegin"},
    {"Camera \"perspective\"\n", "2:1", "without WorldBegin"},
    {"WorldBegin\nWorldBegin", "2:1", "not allowed after WorldBegin"},
    {"WorldBegin\nFilm \"rgb\"", "2:1", "Film is not allowed after"},
    {"Shape \"sphere\"", "1:1", "Shape is not allowed before"},
    {"Import \"x\"", "1:1", "Import is not allowed before"},
    {"WorldBegin\nShpe \"sphere\"", "2:1", "expected one of: Shape"},
    {"WorldBegin\nWorldEnd", "2:1", "older version"},
    {"WorldBegin\n\"Shape\"", "2:1", "expected a directive"},
    {"WorldBegin\nShape sphere", "2:7", "expected a type in quotes, found \"sphere\""},
    {"WorldBegin\nShape", "2:6", "the end of the file"},
    {"WorldBegin\nShape \"s\" \"float\" 1", "2:11", "type name"},
    {"WorldBegin\nShape \"s\" \"float a b\" 1", "2:11", "type name"},
    {"WorldBegin\nShape \"s\" \"flot a\" 1", "2:11", "unknown parameter type \"flot\""},
    {"WorldBegin\nShape \"s\" \"color a\" [1 1 1]", "2:11", "write \"rgb\""},
    {"WorldBegin\nShape \"s\" \"xyz a\" [1 1 1]", "2:11", "write \"rgb\""},
    {"WorldBegin\nShape \"s\" \"float a\"", "2:20", "expected a value"},
    {"WorldBegin\nShape \"s\" \"float a\" [ 1", "2:24", "the end of the file"},
    {"WorldBegin\nShape \"s\" \"float a\" [ 1 \"2\" ]", "2:25", "found \"2\""},
    {"WorldBegin\nShape \"s\" \"float a\" [ [ 1 ] ]", "2:23", "expected more values"},
    {"WorldBegin\nShape \"s\" \"float a\" true", "2:21", "\"true\" is not a finite number"},
    {"WorldBegin\nShape \"s\" \"bool a\" 1", "2:20", "expected true or false"},
    {"WorldBegin\nShape \"s\" \"string a\" 1", "2:22", "expected a string"},
    {"WorldBegin\nShape \"s\" \"integer a\" 1.5", "2:23", "not an integer"},
    {"WorldBegin\nShape \"s\" \"spectrum a\" [ 400 1 500 ]", "2:11", "found 3 numbers"},
    {"WorldBegin\nTranslate 1 2", "2:14", "expected 3 numbers, found 2"},
    {"WorldBegin\nTranslate 1 2 x", "2:15", "\"x\" is not a finite number"},
    {"WorldBegin\nTransform [ 1 0 0 0 ]", "2:21", "expected 16 numbers, found 4"},
    {"WorldBegin\nTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 1 ]", "2:45", "expected \"]\""},
    {"WorldBegin\nScale 0 1 1", "2:1", "singular"},
    {"WorldBegin\nScale 1e-200 1 1 Scale 1e-200 1 1", "2:18", "singular or not finite"},
    {"WorldBegin\nRotate 90 0 0 0", "2:1", "axis"},
    {"WorldBegin\nLookAt 0 0 0 0 0 0 0 1 0", "2:1", "LookAt"},
    {"WorldBegin\nLookAt 0 0 0 0 0 1 0 0 1", "2:1", "LookAt"},
    {"TransformTimes 2 1 WorldBegin", "1:1", "TransformTimes"},
    {"WorldBegin\nActiveTransform Both", "2:17", "expected one of: StartTime"},
    {"WorldBegin\nAttributeEnd", "2:1", "AttributeEnd without AttributeBegin"},
    {"WorldBegin\nAttributeBegin", "2:1", "has no AttributeEnd"},
    {"WorldBegin\nTransformEnd", "2:1", "TransformEnd without TransformBegin"},
    {"WorldBegin\nTransformBegin", "2:1", "TransformBegin has no TransformEnd"},
    {"WorldBegin\nTransformBegin ObjectEnd", "2:16",
     "ObjectEnd inside of the TransformBegin at test.pbrt:2:1; expected TransformEnd"},
    {"WorldBegin\nObjectEnd", "2:1", "ObjectEnd without ObjectBegin"},
    {"WorldBegin\nObjectBegin \"a\"", "2:1", "has no ObjectEnd"},
    {"WorldBegin\nAttributeBegin ObjectBegin \"a\" AttributeEnd", "2:32",
     "inside of the ObjectBegin at test.pbrt:2:16"},
    {"WorldBegin\nObjectBegin \"a\" ObjectBegin \"b\"", "2:17", "do not nest"},
    {"WorldBegin\nObjectBegin \"a\" ObjectInstance \"a\" ObjectEnd", "2:17", "holds itself"},
    {"WorldBegin\nObjectInstances \"a\"", "2:1", "filename"},
    {"WorldBegin\nObjectBegin \"a\" ObjectEnd ObjectBegin \"a\"", "2:27", "defined already, at test.pbrt:2:1"},
    {"WorldBegin\nObjectInstance \"a\"", "2:1", "object \"a\" is not defined"},
    {"WorldBegin\nNamedMaterial \"a\"", "2:1", "material \"a\" is not defined"},
    {"WorldBegin\nMediumInterface \"a\"", "2:1", "medium \"a\" is not defined"},
    {"MediumInterface \"a\" \"\" WorldBegin", "1:1", "medium \"a\" is not defined"},
    {"WorldBegin\nMakeNamedMaterial \"a\"", "2:1", "string type"},
    {"WorldBegin\nMakeNamedMaterial \"a\" \"string type\" \"mix\" MakeNamedMaterial \"a\" \"string type\" \"mix\"",
     "2:43", "defined already, at test.pbrt:2:1"},
    {"WorldBegin\nMakeNamedMedium \"a\" \"string type\" \"x\" MakeNamedMedium \"a\" \"string type\" \"x\"", "2:39",
     "defined already"},
    {"WorldBegin\nTexture \"a\" \"float\" \"x\" Texture \"a\" \"float\" \"x\"", "2:25", "defined already"},
    {"WorldBegin\nTexture \"a\" \"color\" \"x\"", "2:1", "expected one of: float, spectrum"},
    {"Option seed 1 WorldBegin", "1:8", "name in quotes"},
    {"Option \"seed\" WorldBegin", "1:15", "expected a value, found \"WorldBegin\""},
    {"Option \"seed\"", "1:14", "expected a value"},
};
INSTANTIATE_TEST_SUITE_P(All, PbrtParserErrors, testing::ValuesIn(bad_scenes));

TEST(PbrtParser, RepeatedOptionsAndUnknownCoordinateSystemsWarn) {
  Diagnostics diagnostics;
  const auto s = parse("Film \"rgb\" Film \"gbuffer\" WorldBegin CoordSysTransform \"nowhere\"", &diagnostics);
  EXPECT_EQ(s.film.type, "gbuffer");
  EXPECT_EQ(diagnostics.count(), 2u);
}

TEST(PbrtParser, TransformBeginIsAnAlias) {
  const auto s = parse_world("TransformBegin Translate 1 0 0 Shape \"a\" TransformEnd Shape \"b\"");
  EXPECT_EQ(s.shapes[0].transform.start.point({0, 0, 0}), V3f(1, 0, 0));
  EXPECT_EQ(s.shapes[1].transform.start.point({0, 0, 0}), V3f(0, 0, 0));
}

TEST(PbrtParser, HostileNestingIsBounded) {
  std::string text = "WorldBegin ";
  for (int i = 0; i < 200000; ++i) text += "AttributeBegin\n";
  EXPECT_CONTAINS(parse_error(text), "nested more than");
}

TEST(PbrtParser, ManyDefaultsForManyShapesStayLinear) {
  std::string text = "WorldBegin Attribute \"shape\" ";
  for (int i = 0; i < 20000; ++i) text += "\"float p" + std::to_string(i) + "\" 1 ";
  for (int i = 0; i < 20000; ++i) text += "Shape \"a\" ";
  const Timer timer;
  EXPECT_EQ(parse(text).shapes.size(), 20000u);
  EXPECT_LT(timer.seconds(), 3);
}

TEST(PbrtParser, ReadsLargeArraysFast) {
  std::string text = "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ ";
  constexpr size_t n = 3000000;
  for (size_t i = 0; i < n; ++i) text += "0.123456 ";
  text += "]";
  const Timer timer;
  const auto s = parse(text);
  const double seconds = timer.seconds();
  EXPECT_EQ(s.shapes[0].params.get_points3("P").size(), n);
  RecordProperty("megabytes_per_second", int(double(text.size()) / seconds / 1e6));
  EXPECT_LT(seconds, 5);  // hundreds of MB/s by measurement; a loaded or instrumented machine has room
}

TEST(PbrtParser, MovedDescriptionsKeepTheirPlaces) {
  SceneDescription a = parse_world("Shape \"sphere\"");
  const SceneDescription b = std::move(a);
  EXPECT_EQ(b.shapes[0].loc.file.data(), b.files.front().data());
}

// Whatever the text, the parser returns a description or throws InputError.
RC_GTEST_PROP(PbrtParser, SurvivesAnySequenceOfWords, (const std::vector<uint8_t>& picks)) {
  static constexpr const char* words[] = {"WorldBegin",
                                          "AttributeBegin",
                                          "AttributeEnd",
                                          "Shape",
                                          "\"sphere\"",
                                          "\"float radius\"",
                                          "[",
                                          "]",
                                          "1",
                                          "-2.5e3",
                                          "Transform",
                                          "ObjectBegin",
                                          "ObjectEnd",
                                          "ObjectInstance",
                                          "ObjectInstances",
                                          "\"a\"",
                                          "NamedMaterial",
                                          "MakeNamedMaterial",
                                          "\"string type\"",
                                          "\"diffuse\"",
                                          "Scale",
                                          "0",
                                          "LookAt",
                                          "#\n",
                                          "Attribute",
                                          "\"shape\"",
                                          "Texture",
                                          "\"float\"",
                                          "Option",
                                          "true",
                                          "Import",
                                          "Include",
                                          "CoordSysTransform",
                                          "\"camera\"",
                                          "Camera",
                                          "TransformBegin",
                                          "TransformEnd"};
  std::string text = picks.size() % 2 ? "WorldBegin " : "";
  for (const uint8_t p : picks) text.append(words[p % std::size(words)]).append(" ");
  const std::string message = parse_error(text);
  RC_ASSERT(message.empty() || message.rfind("test.pbrt:", 0) == 0);
}

RC_GTEST_PROP(PbrtParser, TransformIsTheProductOfItsParts, (const std::vector<std::pair<uint8_t, int8_t>>& steps)) {
  std::string text;
  Transform expected;
  for (const auto& [kind, value] : steps) {
    const double v = value, s = value == 0 ? 1 : value / 64.0;
    const std::string t = std::to_string(v), u = std::to_string(s);
    if (kind % 3 == 0) {
      text += "Translate " + t + " 1 2 ";
      expected = expected * Transform::translate({v, 1, 2});
    } else if (kind % 3 == 1) {
      text += "Rotate " + t + " 1 2 3 ";
      expected = expected * Transform::rotate(v, {1, 2, 3});
    } else {
      text += "Scale " + u + " 1 2 ";
      expected = expected * Transform::scale({s, 1, 2});
    }
  }
  const auto scene = parse_world(text + "Shape \"a\"");
  const V3f p = scene.shapes[0].transform.start.point({1, 2, 3}), q = expected.point({1, 2, 3});
  RC_ASSERT(length(p - q) <= 1e-4f * (1 + length(q)));
}

}  // namespace
}  // namespace dapple::scenefile
