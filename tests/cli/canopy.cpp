// SPDX-License-Identifier: Apache-2.0
// `dapple canopy solve` as docs/guide/canopy.md describes it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

using nlohmann::json;

json example() {
  return json::parse(R"({
    "layers": [{"bottom_m": 0, "top_m": 2, "leaf_area_index": 2, "leaf_angle_distribution": "horizontal",
                "reflectance": [0.45, 0.1], "transmittance": [0.45, 0.05]}],
    "ground": {"reflectance": [0.15, 0.1]},
    "sun": {"zenith_deg": 30, "azimuth_deg": 0, "irradiance_W_m2": [100, 50]},
    "sky": {"type": "uniform", "irradiance_W_m2": [20, 0]},
    "view": [{"zenith_deg": 40, "azimuth_deg": 77}],
    "quadrature": {"nodes": 4, "modes": 2, "slabs": 3}})");
}

struct Solved {
  ProcessResult process;
  json result;
};

Solved solve(const std::string& text, const std::vector<std::string>& options = {}) {
  ScratchFolder folder;
  const std::string input = folder.file("canopy.json"), output = folder.file("out.json");
  std::ofstream(input) << text;
  std::vector<std::string> arguments{"canopy", "solve", input, "-o", output};
  for (const std::string& o : options) arguments.push_back(o == "FOLDER" ? folder.path().string() : o);
  Solved run{run_dapple(arguments, 60, folder.path().string()), {}};
  if (std::filesystem::exists(output)) run.result = json::parse(std::ifstream(output));
  return run;
}

// Rationale: the numbers of a user's run. Expectation: horizontal leaves have a closed form (RAMI conventions):
// reflectance and transmittance to 1e-10 for sun and sky alike, fluxes in W m^-2, parts that add up to one.
TEST(CanopySolve, HorizontalLeaves) {
  const Solved run = solve(example().dump());
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  const json& r = run.result;
  for (const char* key : {"black_sky", "white_sky", "actual"})
    EXPECT_NEAR(r["albedo"][key][0].get<double>(), 0.4317546137538, 1e-10) << key;
  EXPECT_NEAR(r["transmittance"]["total"][0].get<double>(), 0.4469496437598, 1e-10);
  EXPECT_NEAR(r["view"][0]["reflectance_factor"][0].get<double>(), 0.4317546137538, 1e-9);
  const double in = 100 * std::cos(std::acos(-1.0) / 6) + 20;
  EXPECT_NEAR(r["profile"].back()["up"][0].get<double>(), 0.4317546137538 * in, 1e-8);
  EXPECT_NEAR(r["profile"].back()["down_diffuse"][0].get<double>(), 20, 1e-10);
  EXPECT_EQ(r["profile"].size(), 4u);
  for (int w : {0, 1})
    EXPECT_NEAR(r["albedo"]["actual"][w].get<double>() + r["absorptance"]["canopy"][w].get<double>() +
                    r["absorptance"]["ground"][w].get<double>(),
                1, 1e-12);
}

TEST(CanopySolve, WritesAllItsFiles) {
  json j = example();
  j["layers"][0]["leaf_angle_distribution"] = {{"type", "ellipsoidal"}, {"chi", 1.4}};
  j["ground"] = {{"type", "rpv"}, {"rho0", {0.1, 0.1}}, {"k", 0.8}, {"asymmetry", -0.1}};
  j["sky"]["type"] = "cie_clear";
  j["hot_spot"]["leaf_size_m"] = 0.05;
  ScratchFolder folder;
  const std::string csv = folder.file("o.csv"), exr = folder.file("o.exr"), svg = folder.file("o.svg");
  const Solved run = solve(j.dump(), {"--csv", csv, "--exr", exr, "--plot", svg});
  ASSERT_EQ(run.process.exit_code, 0) << run.process.output;
  std::ifstream table(csv);
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "quantity,z_m,zenith_deg,azimuth_deg,wavelength,value");
  int lines = 0;
  while (std::getline(table, line)) ++lines;
  EXPECT_EQ(lines, 2 * (7 + 4 * 3 + 1));
  EXPECT_GT(std::filesystem::file_size(exr), 1000u);
  std::ifstream drawing(svg);
  const std::string text((std::istreambuf_iterator<char>(drawing)), {});
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.substr(text.size() - 7), "</svg>\n");
}

TEST(CanopySolve, MethodsAgree) {
  json j = example();
  j["layers"][0]["leaf_angle_distribution"] = "plagiophile";
  const json adding = solve(j.dump()).result;
  j["quadrature"]["method"] = "riccati";
  const json riccati = solve(j.dump()).result;
  for (int w : {0, 1})
    EXPECT_NEAR(adding["albedo"]["actual"][w].get<double>(), riccati["albedo"]["actual"][w].get<double>(), 1e-9);
}

struct Bad {
  const char* name;
  const char* pointer;  // what is replaced
  const char* value;
  const char* says;
};

class BadCanopy : public testing::TestWithParam<Bad> {};

// Rationale: bad input. Expectation: exit code 3 and a message with the file, the field, its value and what is legal.
TEST_P(BadCanopy, IsNamed) {
  json j = example();
  j[json::json_pointer(GetParam().pointer)] = json::parse(GetParam().value);
  const Solved run = solve(j.dump());
  EXPECT_EQ(run.process.exit_code, 3) << run.process.output;
  EXPECT_NE(run.process.output.find(GetParam().says), std::string::npos) << run.process.output;
  EXPECT_NE(run.process.output.find("canopy.json"), std::string::npos);
  EXPECT_TRUE(run.result.is_null()) << "nothing is written";
}

INSTANTIATE_TEST_SUITE_P(
    Fields, BadCanopy,
    testing::Values(
        Bad{"NegativeDensity", "/layers/0/leaf_area_index", "-1",
            "layers[0].leaf_area_index is -1, expected a number from 0 to 1000"},
        Bad{"SumAboveOne", "/layers/0/transmittance/0", "0.7",
            "layers[0].transmittance[0] is 0.7 beside a reflectance of 0.45"},
        Bad{"Reflectance", "/layers/0/reflectance/1", "1.5",
            "layers[0].reflectance[1] is 1.5, expected a number from 0 to 1"},
        Bad{"NotANumber", "/layers/0/reflectance/1", "null", "layers[0].reflectance[1] is null"},
        Bad{"NaNAsText", "/layers/0/leaf_area_index", "\"NaN\"", "layers[0].leaf_area_index is \"NaN\""},
        Bad{"WrongLength", "/ground/reflectance", "[0.1,0.1,0.1]", "ground.reflectance has 3 elements"},
        Bad{"Upside", "/layers/0/top_m", "-2", "layers[0].top_m is -2"},
        Bad{"ZeroSlabs", "/quadrature/slabs", "0", "quadrature.slabs is 0, expected an integer from 1 to 1000"},
        Bad{"HugeSlabs", "/quadrature/slabs", "1000000000000000000000", "quadrature.slabs is"},
        Bad{"HugeNodes", "/quadrature/nodes", "1000", "quadrature.nodes is 1000"},
        Bad{"FractionalModes", "/quadrature/modes", "2.5", "quadrature.modes is 2.5"},
        Bad{"SunBelow", "/sun/zenith_deg", "95", "sun.zenith_deg is 95, expected a number from 0 to below 90"},
        Bad{"NegativeSun", "/sun/irradiance_W_m2/0", "-3", "sun.irradiance_W_m2[0] is -3"},
        Bad{"UnknownKey", "/sun/irradiance", "3", "unknown key \"irradiance\" in sun"},
        Bad{"OtherUnits", "/layers/0/top_cm", "200", "unknown key \"top_cm\" in layers[0]"},
        Bad{"UnknownSky", "/sky/type", "\"starry\"", "sky.type is \"starry\""},
        Bad{"UnknownAngles", "/layers/0/leaf_angle_distribution", "\"round\"",
            "layers[0].leaf_angle_distribution is \"round\""},
        Bad{"BetaTooWide", "/layers/0/leaf_angle_distribution",
            R"({"type":"beta","mean_deg":45,"standard_deviation_deg":46})", "standard_deviation_deg is 46"},
        Bad{"TableDescends", "/layers/0/leaf_angle_distribution",
            R"({"type":"table","edges_deg":[0,60,30],"fractions":[1,1]})", "edges_deg[2] is 30"},
        Bad{"TableOfNothing", "/layers/0/leaf_angle_distribution",
            R"({"type":"table","edges_deg":[0,90],"fractions":[0]})", "layers[0].leaf_angle_distribution"},
        Bad{"NoLayers", "/layers", "[]", "layers has 0 elements"}, Bad{"LayersType", "/layers", "{}", "layers is {}"},
        Bad{"ViewBelow", "/view/0/zenith_deg", "120", "view[0].zenith_deg is 120"},
        Bad{"MirrorOfFlatLeaves", "/layers/0/refractive_index", "1.5", "layers[0].refractive_index"},
        Bad{"NoSuchImage", "/sky", R"({"type":"image","image":"no.exr","irradiance_W_m2":1})", "no.exr"}),
    [](const auto& tested) { return std::string(tested.param.name); });

// Rationale: files that are no canopy at all, or meant to exhaust. Expectation: exit code 3 in seconds and bounded
// memory.
TEST(CanopyFile, HostileFiles) {
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  std::string nested = R"({"layers":)";
  for (int i = 0; i < 100000; ++i) nested += R"({"a":)";
  for (const std::string& text :
       {std::string(), std::string("["), std::string("NaN"), std::string("{\"layers\": NaN}"), deep, nested,
        std::string("{\"layers\":[], \"layers\":[]}"), std::string("\xff\xfe{}"), std::string("{\"layers\": 1e999}"),
        std::string("[1, 2]"), std::string(1 << 20, ' ')}) {
    const Solved run = solve(text);
    EXPECT_EQ(run.process.exit_code, 3) << text.substr(0, 30) << "\n" << run.process.output.substr(0, 500);
    EXPECT_LT(run.process.output.size(), 2000u);
  }
  EXPECT_EQ(run_dapple({"canopy", "solve", "/dev/zero"}, 60).exit_code, 3);
  const auto says = [](const ProcessResult& result, const std::string& words) {
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
  };
  says(run_dapple({"canopy", "solve", "/"}, 60), "/: cannot read the file: Is a directory");
  says(run_dapple({"canopy", "solve", "no-such-file.json"}, 60),
       "no-such-file.json: cannot read the file: No such file");
  const Solved overflow = solve("{\"layers\": 1e999}");
  says(overflow.process, ".json: a number is too large: '1e999'");
  EXPECT_EQ(overflow.process.output.find("exception"), std::string::npos) << overflow.process.output;
}

TEST(CanopyFile, UsageAndPlaces) {
  EXPECT_EQ(run_dapple({"canopy"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"canopy", "solve"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"canopy", "solve", "--help"}, 60).exit_code, 0);
  EXPECT_EQ(solve(example().dump(), {"--plot", "x.gif"}).process.exit_code, 2);
  EXPECT_EQ(solve(example().dump(), {"--csv", "/no/such/folder/x.csv"}).process.exit_code, 4);
}

}  // namespace
}  // namespace dapple::test
