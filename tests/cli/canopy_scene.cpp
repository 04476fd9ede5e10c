// SPDX-License-Identifier: Apache-2.0
// `dapple canopy reflect` and `dapple canopy measure` as docs/guide/canopy.md describes them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

using nlohmann::json;

const char* const sun_and_ground = R"(
WorldBegin
LightSource "distant" "rgb L" [ 2 2 2 ] "point3 from" [ 1 0 2 ] "point3 to" [ 0 0 0 ]
MakeNamedMaterial "soil" "string type" [ "diffuse" ] "rgb reflectance" [ .3 .2 .1 ]
MakeNamedMaterial "leaf" "string type" [ "diffusetransmission" ] "rgb reflectance" [ .5 .1 .4 ] "rgb transmittance" [ .4 .1 .5 ]
NamedMaterial "soil"
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
)";

struct Ran {
  ProcessResult process;
  json result;
};

Ran run_on(const std::string& command, const std::string& scene, const std::vector<std::string>& options) {
  ScratchFolder folder;
  const std::string input = folder.file("scene.pbrt"), output = folder.file("out.json");
  std::ofstream(input) << scene;
  std::vector<std::string> arguments{"canopy", command, input, "-o", output};
  arguments.insert(arguments.end(), options.begin(), options.end());
  Ran run{run_dapple(arguments, 120, folder.path().string()), {}};
  if (std::filesystem::exists(output)) run.result = json::parse(std::ifstream(output));
  return run;
}

// A cloud of disks with all normals at random, as the RAMI tables give them.
std::string disk_table(int count, double radius, double half, double low, double high) {
  std::string text;
  uint64_t state = 88172645463325252ull;
  const auto next = [&state] {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return double(state >> 11) * 0x1p-53;
  };
  for (int i = 0; i < count; ++i) {
    const double z = 2 * next() - 1, phi = 2 * std::acos(-1.0) * next(), s = std::sqrt(1 - z * z);
    char line[160];
    std::snprintf(line, sizeof line, "%g %.5f %.5f %.5f %.6f %.6f %.6f\n", radius, half * (2 * next() - 1),
                  half * (2 * next() - 1), low + (high - low) * next(), s * std::cos(phi), s * std::sin(phi), z);
    text += line;
  }
  return text;
}

// Rationale: a Lambertian plane reflects its reflectance in every direction. Expectation: that, in all channels, with
// no spread; the irradiance of the sun on the level.
TEST(CanopyReflect, GroundAlone) {
  const Ran run = run_on("reflect", sun_and_ground, {"--view", "0,0", "--view", "60,200", "--samples", "256"});
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  for (const json& v : run.result["view"])
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(v["reflectance_factor"][c].get<double>(), 0.3 - 0.1 * double(c), 1e-6);
      EXPECT_LT(v["standard_error"][c].get<double>(), 1e-6);
    }
  EXPECT_NEAR(run.result["irradiance_W_m2"][0].get<double>(), 2 * 2 / std::sqrt(5.0), 1e-6);
}

// Rationale: energy. Leaves that absorb nothing over ground that absorbs nothing, repeated without end, send all light
// back: the mean of the reflectance factor over the hemisphere, weighted by the projected solid angle, is 1, whatever
// the leaves are like. Expectation: 1 within 4 standard errors of that mean, which is below half a percent. Breaks if
// copies across borders are missing.
TEST(CanopyReflect, PeriodicFurnaceGivesBackAllLight) {
  const std::string scene = R"(
WorldBegin
LightSource "distant" "rgb L" [ 1 1 1 ] "point3 from" [ 1 2 3 ] "point3 to" [ 0 0 0 ]
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
Material "diffusetransmission" "rgb reflectance" [ .5 .3 .7 ] "rgb transmittance" [ .5 .7 .3 ]
AttributeBegin
  Translate .8 -.9 1  Rotate 30 1 2 0
  Shape "disk" "float radius" [ .7 ]
AttributeEnd
Shape "disks" "point3 P" [ -1 .9 .5  .3 0 1.4 ] "normal N" [ 1 1 1  0 .3 1 ] "float radius" [ .5 .6 ]
)";
  std::vector<std::string> options{"--period=-1,1,-1,1", "--samples", "1024", "--replicates", "8"};
  const int zeniths = 6, azimuths = 8;
  std::vector<double> weights;
  for (int i = 0; i < zeniths; ++i)
    for (int a = 0; a < azimuths; ++a) {
      const double zenith =
          std::asin(std::sqrt((i + 0.5) / zeniths)) * 180 / std::acos(-1.0);  // equal projected solid angles
      options.insert(options.end(), {"--view", std::to_string(zenith) + "," + std::to_string(45.0 * a + 7)});
    }
  const Ran run = run_on("reflect", scene, options);
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  for (size_t c = 0; c < 3; ++c) {
    double mean = 0, variance = 0;
    const double n = double(run.result["view"].size());
    for (const json& v : run.result["view"]) {
      mean += v["reflectance_factor"][c].get<double>() / n;
      variance += std::pow(v["standard_error"][c].get<double>() / n, 2);
    }
    EXPECT_LT(std::sqrt(variance), 0.005);
    EXPECT_NEAR(mean, 1, 4 * std::sqrt(variance) + 0.01) << "0.01: quadrature over 48 directions";
  }
}

// Rationale: the result is a property of the scene. Expectation: the same text for one thread and for three; the same
// numbers within their errors where the same leaves are cut by the cell's border elsewhere, and where the cell is two
// by two of the smaller one.
TEST(CanopyReflect, DependsOnNeitherThreadsNorTheCell) {
  ScratchFolder folder;
  std::ofstream(folder.file("leaves.def")) << disk_table(400, 0.2, 2, 0.3, 3);
  const std::string scene = std::string(sun_and_ground) +
                            "ObjectBegin \"cloud\"\nNamedMaterial \"leaf\"\nShape \"disks\" \"string filename\" [ \"" +
                            folder.file("leaves.def") + "\" ]\nObjectEnd\nObjectInstance \"cloud\"\n";
  const std::vector<std::string> common{"--height",     "3.5", "--principal-plane=-60,60,40", "--samples", "2048",
                                        "--replicates", "8"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), common.begin(), common.end());
    Ran run = run_on("reflect", scene, more);
    EXPECT_EQ(run.process.exit_code, 0) << run.process.output;
    return run.result;
  };
  json one = with({"--period=-2,2,-2,2", "--threads", "1"}), three = with({"--period=-2,2,-2,2", "--threads", "3"});
  one.erase("scene"), three.erase("scene");
  EXPECT_EQ(one.dump(), three.dump());
  // The ground spans the cell around the origin; elsewhere a copy of it must.
  const json shifted = with({"--period=-1,3,-0.5,3.5"});
  for (size_t v = 0; v < one["view"].size(); ++v)
    for (size_t c = 0; c < 3; ++c) {
      const json &a = one["view"][v], &b = shifted["view"][v];
      const double error = std::hypot(a["standard_error"][c].get<double>(), b["standard_error"][c].get<double>());
      EXPECT_LT(error, 0.02);
      EXPECT_NEAR(a["reflectance_factor"][c].get<double>(), b["reflectance_factor"][c].get<double>(), 4 * error);
    }
}

// Rationale: disks and quadrics are the same surfaces to Embree and to us. Expectation: one leaf as a cloud of one
// disk, as a quadric and as a polygon of many corners measure the same area, and reflect the same within four standard
// errors.
TEST(CanopyMeasure, DisksAreDisks) {
  const std::string leaf = std::string(sun_and_ground) + "NamedMaterial \"leaf\"\n";
  const std::string cloud =
      leaf + "Shape \"disks\" \"point3 P\" [ .2 .1 1 ] \"normal N\" [ 1 0 1 ] \"float radius\" [ .8 ]\n";
  const std::string quadric =
      leaf + "AttributeBegin Translate .2 .1 1 Rotate 45 0 1 0 Shape \"disk\" \"float radius\" [ .8 ] AttributeEnd\n";
  const Ran a = run_on("measure", cloud, {"--slabs", "1"}), b = run_on("measure", quadric, {"--slabs", "1"});
  ASSERT_EQ(a.process.exit_code, 0) << a.process.output;
  ASSERT_EQ(b.process.exit_code, 0) << b.process.output;
  const double index = std::acos(-1.0) * 0.64 / 16;
  EXPECT_NEAR(a.result["measured"]["leaf_area_index"].get<double>(), index, 1e-6);
  EXPECT_NEAR(b.result["measured"]["leaf_area_index"].get<double>(), index, 1e-5);
  const std::vector<std::string> options{"--view", "30,40", "--samples", "4096", "--height", "3"};
  const json x = run_on("reflect", cloud, options).result, y = run_on("reflect", quadric, options).result;
  const double error =
      std::hypot(x["view"][0]["standard_error"][0].get<double>(), y["view"][0]["standard_error"][0].get<double>());
  EXPECT_NEAR(x["view"][0]["reflectance_factor"][0].get<double>(), y["view"][0]["reflectance_factor"][0].get<double>(),
              4 * error + 1e-6);
  EXPECT_LT(error, 0.005);
}

// Rationale: leaf area by height, by hand: a rectangle of 1 x .5 m, inclined by asin(.8), instanced at twice the size,
// and bark, a closed tube of which half counts. Expectation: areas to rounding, each slab of equal height the same
// share, one inclination bin.
TEST(CanopyMeasure, AreaByHeightInclinationAndMaterial) {
  const std::string scene = std::string(sun_and_ground) + R"(
ObjectBegin "tree"
  NamedMaterial "leaf"
  Shape "bilinearmesh" "point3 P" [ 0 0 0  0 .5 0  .6 0 .8  .6 .5 .8 ]
  MakeNamedMaterial "bark" "string type" [ "diffuse" ] "rgb reflectance" [ .2 .2 .2 ]
  NamedMaterial "bark"
  Shape "cylinder" "float radius" [ .05 ] "float zmin" [ 0 ] "float zmax" [ .8 ]
ObjectEnd
AttributeBegin Scale 2 2 2 ObjectInstance "tree" AttributeEnd
)";
  const Ran run = run_on("measure", scene, {"--slabs", "4", "--inclinations", "9", "--no-clumping"});
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  double leaf = 0, bark = 0;
  for (const json& l : run.result["layers"]) {
    const bool is_leaf = l["transmittance"][0].get<double>() > 0;
    const double area = l["leaf_area_index"].get<double>() * 16, expected = is_leaf ? 2.0 : std::acos(-1.0) * 0.1 * 1.6;
    EXPECT_NEAR(area, expected / 4, 1e-4 * expected);
    EXPECT_NEAR(l["leaf_angle_distribution"]["fractions"][is_leaf ? 5 : 8].get<double>(), 1, 1e-5);
    (is_leaf ? leaf : bark) += area;
  }
  EXPECT_NEAR(leaf, 2, 1e-4);
  EXPECT_NEAR(bark, std::acos(-1.0) * 0.1 * 1.6, 1e-4);
  EXPECT_NEAR(run.result["ground"]["reflectance"][1].get<double>(), 0.2, 1e-6);
  EXPECT_NEAR(run.result["sun"]["zenith_deg"].get<double>(), std::atan(0.5) * 180 / std::acos(-1.0), 1e-4);
}

// Rationale: a dense layer of small leaves at random is what the plane-parallel equations describe. Expectation:
// clumping index 1 within .04 (400 leaves), and `measure` piped into `solve` gives the reflectance factors that paths
// see, within 3 percent and four standard errors: away from the hot spot, which leaves without size have not.
TEST(CanopyMeasure, SolvedStatisticsReflectAsTheSceneDoes) {
  ScratchFolder folder;
  std::ofstream(folder.file("leaves.def")) << disk_table(24000, 0.03, 2, 0, 8);
  const std::string scene = folder.file("scene.pbrt"), file = folder.file("canopy.json"),
                    solved = folder.file("solved.json");
  std::ofstream(scene) << sun_and_ground
                       << "NamedMaterial \"leaf\"\nShape \"disks\" \"string filename\" [ \"leaves.def\" ]\n";
  ASSERT_EQ(run_dapple({"canopy", "measure", scene, "--period=-2,2,-2,2", "--slabs", "8", "-o", file}, 120).exit_code,
            0);
  json canopy = json::parse(std::ifstream(file));
  EXPECT_NEAR(canopy["measured"]["leaf_area_index"].get<double>(), 24000 * std::acos(-1.0) * 0.0009 / 16, 1e-3);
  EXPECT_NEAR(canopy["measured"]["clumping"]["index"].get<double>(), 1, 0.04);
  canopy["view"] = json::array({{{"zenith_deg", 30}, {"azimuth_deg", 180}}, {{"zenith_deg", 55}, {"azimuth_deg", 90}}});
  std::ofstream(file) << canopy;
  ASSERT_EQ(run_dapple({"canopy", "solve", file, "-o", solved}, 60).exit_code, 0);
  const json expected = json::parse(std::ifstream(solved));
  const std::string traced = folder.file("traced.json");
  const ProcessResult run =
      run_dapple({"canopy", "reflect", scene, "--period=-2,2,-2,2", "--height", "9", "--view", "30,180", "--view",
                  "55,90", "--samples", "4096", "--replicates", "8", "-o", traced},
                 240);
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const json got = json::parse(std::ifstream(traced));
  for (size_t v = 0; v < 2; ++v)
    for (size_t c = 0; c < 3; ++c) {
      const double x = expected["view"][v]["reflectance_factor"][c].get<double>(),
                   y = got["view"][v]["reflectance_factor"][c].get<double>();
      EXPECT_NEAR(x, y, 0.03 * y + 4 * got["view"][v]["standard_error"][c].get<double>())
          << "view " << v << " channel " << c;
    }
}

// Rationale: of what moves, areas are counted at the middle of the shutter, so gaps have to be too. A leaf that shades
// all of the plot then, and is far beside it when the shutter opens and closes. Expectation: no gap.
TEST(CanopyMeasure, GapsAreThoseOfTheMiddleOfTheShutter) {
  const std::string moving = std::string(sun_and_ground) + R"(
NamedMaterial "leaf"
Shape "disks" "point3 P" [ 0 0 2 ] "normal N" [ 1 0 1 ] "float radius" [ .1 ]
ActiveTransform StartTime Translate -100 0 0 ActiveTransform EndTime Translate 100 0 0 ActiveTransform All
Shape "bilinearmesh" "point3 P" [ -20 -20 1  20 -20 1  -20 20 1  20 20 1 ]
)";
  const Ran run = run_on("measure", moving, {"--area=-2,2,-2,2", "--gap-rays", "1024"});
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  for (const json& gap : run.result["measured"]["clumping"]["gap_fraction"]) EXPECT_LE(gap.get<double>(), 0.5 / 1024);
}

struct BadRun {
  const char* name;
  const char* command;
  std::vector<std::string> options;
  const char* scene;  // added to the ground
  int exit_code;
  const char* says;
};

class BadCanopyScene : public testing::TestWithParam<BadRun> {};

// Rationale: bad input. Expectation: exit code 2 for options and 3 for scenes, and a message with what is wrong and
// what is legal.
TEST_P(BadCanopyScene, IsNamed) {
  const BadRun& bad = GetParam();
  const Ran run = run_on(bad.command, std::string(sun_and_ground) + bad.scene, bad.options);
  EXPECT_EQ(run.process.exit_code, bad.exit_code) << run.process.output;
  EXPECT_NE(run.process.output.find(bad.says), std::string::npos) << run.process.output;
  EXPECT_TRUE(run.result.is_null()) << "nothing is written";
}

INSTANTIATE_TEST_SUITE_P(
    Options, BadCanopyScene,
    testing::Values(
        BadRun{"Period", "reflect", {"--period", "0,1,2"}, "", 2, "--period: \"0,1,2\"; expected X0,X1,Y0,Y1"},
        BadRun{"EmptyPeriod", "reflect", {"--period", "1,1,0,2"}, "", 2, "expected X0 below X1"},
        BadRun{"HugeArea",
               "measure",
               {"--area", "0,1e10,0,1"},
               "",
               2,
               "--area is 1e+10, expected a number from -1000000000 to 1000000000 m"},
        BadRun{"HexadecimalArea",
               "measure",
               {"--area", "0,0x10,0,1"},
               "",
               2,
               "--area: \"0,0x10,0,1\"; expected X0,X1,Y0,Y1 in metres"},
        BadRun{"AreaOfNaN", "measure", {"--area", "0,nan,0,1"}, "", 2, "--area: \"0,nan,0,1\""},
        BadRun{"ViewBelow",
               "reflect",
               {"--view", "95,0"},
               "",
               2,
               "--view zenith is 95, expected a number from 0 to 89.9 degrees"},
        BadRun{"Azimuth", "reflect", {"--view", "5,1000"}, "", 2, "--view azimuth is 1000"},
        BadRun{"SunBelow", "reflect", {"--sun", "91,0"}, "", 2, "--sun zenith is 91"},
        BadRun{"Plane", "reflect", {"--principal-plane=0,60,0"}, "", 2, "--principal-plane STEP is 0"},
        BadRun{"PlaneBackwards", "reflect", {"--principal-plane=60,0,5"}, "", 2, "--principal-plane TO is 0"},
        BadRun{"Height", "reflect", {"--height", "high"}, "", 2, "--height: \"high\"; expected metres"},
        BadRun{"NoSamples", "reflect", {"--samples", "0"}, "", 2, "--samples"},
        BadRun{"OneReplicate", "reflect", {"--replicates", "1"}, "", 2, "--replicates"},
        BadRun{"NoSlabs", "measure", {"--slabs", "0"}, "", 2, "--slabs"},
        BadRun{"Inclinations", "measure", {"--inclinations", "1000"}, "", 2, "--inclinations"},
        BadRun{"GapRays", "measure", {"--gap-rays", "1"}, "", 2, "--gap-rays"},
        BadRun{"UnknownGround",
               "measure",
               {"--ground", "sand"},
               "",
               2,
               "--ground: no material is named \"sand\"; expected one of: leaf, soil"},
        BadRun{"NoLeaves", "measure", {}, "", 3, "no surfaces above the ground"},
        BadRun{"LampAmongLeaves", "reflect", {}, "LightSource \"point\"\n", 3, "lights that are not at infinity"},
        BadRun{"TooManyCells",
               "reflect",
               {"--period", "0,0.001,0,0.001"},
               "Shape \"sphere\"\n",
               3,
               "more than 10,000 cells"},
        BadRun{"NoSuchTable", "reflect", {}, "Shape \"disks\" \"string filename\" [ \"no.def\" ]\n", 3, "no.def"},
        BadRun{"NormalsMissing",
               "reflect",
               {},
               "Shape \"disks\" \"point3 P\" [ 0 0 1 ]\n",
               3,
               "\"N\" has 0 values; expected one for each of the 1"},
        BadRun{"Radius",
               "reflect",
               {},
               "Shape \"disks\" \"point3 P\" [ 0 0 1 ] \"normal N\" [ 0 0 1 ] \"float radius\" [ -1 ]\n",
               3,
               "it must be above 0"},
        BadRun{"RadiusCount",
               "reflect",
               {},
               "Shape \"disks\" \"point3 P\" [ 0 0 1 ] \"normal N\" [ 0 0 1 ] \"float radius\" [ 1 2 ]\n",
               3,
               "expected 1 or 1"},
        BadRun{"ZeroNormal",
               "reflect",
               {},
               "Shape \"disks\" \"point3 P\" [ 0 0 1 ] \"normal N\" [ 0 0 0 ]\n",
               3,
               "has no length"},
        BadRun{"Ellipses",
               "reflect",
               {},
               "Scale 1 2 1\nShape \"disks\" \"point3 P\" [ 0 0 1 ] \"normal N\" [ 0 0 1 ]\n",
               3,
               "ellipses"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(CanopyReflect, NoLightFromAbove) {
  const Ran run = run_on("reflect", R"(
WorldBegin
LightSource "distant" "point3 from" [ 0 0 -1 ] "point3 to" [ 0 0 0 ]
Shape "disk"
)",
                         {});
  EXPECT_EQ(run.process.exit_code, 3);
  EXPECT_NE(run.process.output.find("no light comes from above"), std::string::npos) << run.process.output;
}

}  // namespace
}  // namespace dapple::test
