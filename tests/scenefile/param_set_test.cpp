// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/param_set.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::error_of;

Param real(const std::string& name, std::vector<float> values) {
  Param p;
  p.name = name;
  p.loc = {"file.pbrt", 3, 9};
  p.numbers = std::move(values);
  return p;
}

Param string(const std::string& name, const std::string& value) {
  Param p = real(name, {});
  p.type = ParamType::string;
  p.strings = {value};
  return p;
}

TEST(ParamSet, LooksUpValuesAndFallsBack) {
  ParamSet set;
  set.add(real("radius", {2}));
  set.add(string("filename", "a.ply"));
  EXPECT_EQ(set.get_float("radius", 1), 2);
  EXPECT_EQ(set.get_float("height", 7), 7);
  EXPECT_EQ(set.get_string("filename", ""), "a.ply");
  EXPECT_EQ(set.get_point3("P", V3d(1, 2, 3)), V3d(1, 2, 3));
  EXPECT_TRUE(set.get_ints("indices").empty());
}

TEST(ParamSet, WrongTypeNamesPlaceNameTypeAndCount) {
  ParamSet set;
  set.add(string("radius", "big"));
  set.add(real("pair", {1, 2}));
  EXPECT_EQ(
      error_of([&] { set.get_float("radius", 1); }),
      "file.pbrt:3:9: parameter \"radius\": expected type \"float\" with 1 value, found type \"string\" with 1 value");
  EXPECT_EQ(
      error_of([&] { set.get_float("pair", 1); }),
      "file.pbrt:3:9: parameter \"pair\": expected type \"float\" with 1 value, found type \"float\" with 2 values");
  EXPECT_NE(error_of([&] { set.get_ints("pair"); }), "");
  EXPECT_NE(error_of([&] { set.get_strings("pair"); }), "");
  EXPECT_NE(error_of([&] { set.get_bool("pair", false); }), "");
  EXPECT_NE(error_of([&] { set.get_points2("pair"); }), "");
}

TEST(ParamSet, PointCountsMustBeMultiples) {
  ParamSet set;
  Param p = real("P", {0, 0, 0, 1});
  p.type = ParamType::point3;
  set.add(p);
  EXPECT_CONTAINS(error_of([&] { set.get_points3("P"); }), "multiple of 3 values, found type \"point3\" with 4 values");
}

TEST(ParamSet, ChoiceListsLegalNames) {
  ParamSet set;
  set.add(string("filter", "cubic"));
  set.add(string("wrap", "clamp"));
  EXPECT_EQ(set.get_choice("wrap", {"repeat", "clamp"}, 0), 1);
  EXPECT_EQ(set.get_choice("none", {"repeat", "clamp"}, 0), 0);
  EXPECT_CONTAINS(error_of([&] {
                    set.get_choice("filter", {"point", "bilinear"}, 0);
                  }),
                  "\"cubic\" is unknown; expected one of: point, bilinear");
}

TEST(ParamSet, OfNamesGivenTwiceTheLastCounts) {
  ParamSet set;
  EXPECT_FALSE(set.add(real("a", {1})));
  const auto first = set.add(real("a", {3}));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->to_string(), "file.pbrt:3:9");
  EXPECT_EQ(set.all().size(), 1u);
  EXPECT_EQ(set.get_float("a", 0), 3);
}

TEST(ParamSet, FindByTypeLeavesOtherTypesUnused) {
  ParamSet set;
  set.add(string("alpha", "leaf"));
  EXPECT_EQ(set.find("alpha", ParamType::texture), nullptr);
  EXPECT_FALSE(set.all()[0].used);
  EXPECT_NE(set.find("alpha", ParamType::string), nullptr);
  EXPECT_TRUE(set.all()[0].used);
}

TEST(ParamSet, DefaultsStepBackBehindOwnAndAreNeverReported) {
  auto defaults = std::make_shared<ParamSet>();
  defaults->add(real("a", {1}));
  defaults->add(real("b", {2}));
  defaults->add(real("odd", {3}));
  ParamSet set;
  set.add(real("a", {10}));
  set.set_defaults(defaults);
  EXPECT_EQ(set.get_float("a", 0), 10);
  EXPECT_EQ(set.get_float("b", 0), 2);
  Diagnostics diagnostics(true);
  EXPECT_NO_THROW(set.report_unused("Shape", diagnostics));
}

TEST(ParamSet, ReportsUnusedWithLegalNames) {
  set_log_level(0);
  ParamSet set;
  set.add(real("radios", {1}));
  set.get_float("radius", 1);
  set.get_float("zmin", 0);
  Diagnostics diagnostics;
  set.report_unused("Shape \"sphere\"", diagnostics);
  ASSERT_EQ(diagnostics.count(), 1u);
  EXPECT_EQ(diagnostics.messages()[0],
            "file.pbrt:3:9: parameter \"radios\" of Shape \"sphere\" is not used; expected one of: radius, zmin");
}

TEST(ParamSet, ReportOfManyIsShort) {
  set_log_level(0);
  ParamSet set;
  for (int i = 0; i < 200000; ++i) set.add(real("p" + std::to_string(i), {1}));
  Diagnostics diagnostics;
  set.report_unused("Shape", diagnostics);
  EXPECT_LE(diagnostics.count(), 10u);
  EXPECT_CONTAINS(diagnostics.messages().back(), "more parameters of Shape are not used");
}

// If each look-up went through all, this would run into the test's time-out of ten minutes; it takes a second.
TEST(ParamSet, HoldsManyParameters) {
  ParamSet set;
  constexpr int n = 600000;
  for (int i = 0; i < n; ++i) set.add(real("p" + std::to_string(i), {float(i)}));
  for (int i = 0; i < n; ++i) ASSERT_EQ(set.get_float("p" + std::to_string(i), -1), float(i));
}

RC_GTEST_PROP(ParamSet, BehavesLikeAMap, (const std::vector<std::pair<uint8_t, float>>& entries)) {
  ParamSet set;
  std::map<std::string, float> expected;
  for (const auto& [key, value] : entries) {
    const std::string name = "n" + std::to_string(key);
    const bool is_new = expected.insert_or_assign(name, value).second;
    RC_ASSERT(is_new == !set.add(real(name, {value})));
  }
  RC_ASSERT(set.all().size() == expected.size());
  for (int key = 0; key < 256; ++key) {
    const std::string name = "n" + std::to_string(key);
    const Param* p = set.find(name);
    RC_ASSERT((p != nullptr) == expected.contains(name));
    if (p) RC_ASSERT(p->numbers[0] == expected[name]);
  }
}

}  // namespace
}  // namespace dapple::scenefile
