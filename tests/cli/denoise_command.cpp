// SPDX-License-Identifier: Apache-2.0
// dapple denoise, as its users run it: images of several renderers.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include "tests/support/dapple_program.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

constexpr int width = 48, height = 40;
using Names = std::vector<std::string>;

struct Part {
  std::string name;
  Names channels;
  std::vector<float> pixels;  ///< of all channels
  OIIO::TypeDesc type = OIIO::TypeDesc::FLOAT;
  int tile = 0, w = width, h = height;
  std::string compression = "zip";
  std::map<std::string, float> numbers = {};  ///< of the header
  std::string software = {};
};

void write_parts(const std::string& path, const std::vector<Part>& parts) {
  std::vector<OIIO::ImageSpec> specs;
  for (const Part& part : parts) {
    OIIO::ImageSpec spec(part.w, part.h, int(part.channels.size()), part.type);
    spec.channelnames = part.channels;
    spec.attribute("compression", part.compression);
    spec.attribute("shot", "seven");
    if (!part.software.empty()) spec.attribute("Software", part.software);
    for (const auto& [attribute, number] : part.numbers) spec.attribute(attribute, number);
    spec.full_width = parts[0].w, spec.full_height = parts[0].h;
    if (!part.name.empty()) spec.attribute("oiio:subimagename", part.name);
    spec.tile_width = spec.tile_height = part.tile;
    specs.push_back(spec);
  }
  const auto out = OIIO::ImageOutput::create("openexr");
  ASSERT_TRUE(specs.size() == 1 ? out->open(path, specs[0]) : out->open(path, int(specs.size()), specs.data()))
      << out->geterror();
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) {
      ASSERT_TRUE(out->open(path, specs[i], OIIO::ImageOutput::AppendSubimage)) << out->geterror();
    }
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, parts[i].pixels.data())) << out->geterror();
  }
  ASSERT_TRUE(out->close());
}

float noise(int x, int y, int c) {
  return float((x * 7919 + y * 104729 + c * 31) % 101) / 101;
}

/// Colour, albedo and normal of a noisy checker.
std::vector<float> picture(int w = width, int h = height) {
  std::vector<float> p;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const float albedo = (x / 8 + y / 8) % 2 ? .8f : .3f;
      for (int c = 0; c < 3; ++c) p.push_back(albedo * (.3f + noise(x, y, c)));
      p.insert(p.end(), {albedo, albedo, albedo, 0, .6f, .8f});
    }
  return p;
}

std::vector<float> channels_of(const std::vector<float>& all, int first, int n, int stride = 9) {
  std::vector<float> p;
  for (size_t i = 0; i < all.size(); i += size_t(stride))
    p.insert(p.end(), &all[i + size_t(first)], &all[i + size_t(first)] + n);
  return p;
}

const Names dapple_names{"R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z"};

class DenoiseCommand : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  ProcessResult denoise(const std::string& in, const std::string& out,
                        const std::vector<std::string>& options = {}) const {
    std::vector<std::string> all{"denoise", file(in), "-o", file(out)};
    all.insert(all.end(), options.begin(), options.end());
    return run_dapple(all, 120);
  }
  ExrLayers denoised(const std::vector<Part>& parts) const {
    write_parts(file("in.exr"), parts);
    const ProcessResult result = denoise("in.exr", "out.exr");
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_EQ(result.output.find("warning"), std::string::npos) << result.output;
    return ExrLayers(file("out.exr"));
  }
  void expect_refused(int exit_code, const std::vector<Part>& parts, const Names& words,
                      const std::vector<std::string>& options = {}) const {
    write_parts(file("bad.exr"), parts);
    expect_refused(exit_code, "bad.exr", words, options);
  }
  void expect_refused(int exit_code, const std::string& in, const Names& words,
                      const std::vector<std::string>& options = {}) const {
    const ProcessResult result = denoise(in, "none.exr", options);
    EXPECT_EQ(result.exit_code, exit_code) << result.output;
    for (const std::string& word : words)
      EXPECT_NE(result.output.find(word), std::string::npos) << word << "\n" << result.output;
    EXPECT_FALSE(std::filesystem::exists(file("none.exr")));
  }

  ScratchFolder folder_;
};

TEST_F(DenoiseCommand, GivesWhatRenderGives) {
  const std::string cornell = source_path("scenes/cornell-box/cornell.pbrt");
  const auto render = [&](const std::string& image, const std::string& on, const std::string& aovs) {
    return run_dapple({"render", cornell, "-o", file(image), "--integrator", "path", "--pixel-samples", "2",
                       "--resolution", "60x44", "--float", "--denoise", on, "--aov", aovs},
                      60)
        .exit_code;
  };
  ASSERT_EQ(render("noisy.exr", "off", "albedo,normal,direct,depth"), 0);
  ASSERT_EQ(render("render.exr", "on", "depth"), 0);
  ASSERT_EQ(denoise("noisy.exr", "out.exr", {"--threads", "3"}).exit_code, 0);
  ASSERT_EQ(run_dapple({"render", cornell, "-o", file("full.exr"), "--integrator", "path", "--pixel-samples", "2",
                        "--resolution", "60x44", "--float", "--denoise", "on", "--aov", "albedo,normal,direct"},
                       60)
                .exit_code,
            0);
  ASSERT_EQ(denoise("full.exr", "again.exr").exit_code, 0);
  const ExrLayers rendered(file("render.exr")), command(file("out.exr")), again(file("again.exr")),
      noisy(file("noisy.exr"));
  for (const char* c : {"R", "G", "B"}) {
    EXPECT_EQ(command[c], rendered[c]) << c;
    EXPECT_EQ(again[c], rendered[c]) << c;  // from the noisy layer, not from what is denoised already
    EXPECT_EQ(again[std::string("noisy.") + c], noisy[c]) << c;
  }
  EXPECT_EQ(command["Z"], noisy["Z"]);
  EXPECT_EQ(command.text("dapple/denoised"), rendered.text("dapple/denoised"));
}

// A group may have the name of a picture.
TEST_F(DenoiseCommand, GroupsAddUpWhateverTheirNames) {
  std::vector<float> all;
  for (const float v : channels_of(picture(), 0, 1))
    all.insert(all.end(), {v, v, v, .25f * v, .25f * v, .25f * v, .75f * v, .75f * v, .75f * v});
  write_parts(file("in.exr"), {{"",
                                {"R", "G", "B", "light.color.R", "light.color.G", "light.color.B", "light.rest.R",
                                 "light.rest.G", "light.rest.B"},
                                all}});
  ASSERT_EQ(denoise("in.exr", "out.exr").exit_code, 0);
  const ExrLayers out(file("out.exr"));
  for (size_t i = 0; i < out["R"].size(); ++i)
    ASSERT_NEAR(out["light.color.R"][i] + out["light.rest.R"][i], out["R"][i], 1e-5f * std::max(1.0f, out["R"][i]))
        << i;
}

// Groups have no noisy layers: those of a denoised picture are denoised.
TEST_F(DenoiseCommand, GroupsOfDenoisedPicturesStay) {
  std::ofstream(file("scene.pbrt")) << "LookAt 0 1 -5 0 1 0 0 1 0 Camera \"perspective\" WorldBegin "
                                       "LightSource \"infinite\" \"string group\" \"sky\" "
                                       "LightSource \"point\" \"string group\" \"key\" \"point3 from\" [1 3 -2] "
                                       "\"rgb I\" [9 6 3] Shape \"sphere\" Translate 0 -1 0 Shape \"disk\" "
                                       "\"float radius\" 3 Translate 1 2 1 Shape \"sphere\"\n";
  ASSERT_EQ(run_dapple({"render", file("scene.pbrt"), "-o", file("in.exr"), "--integrator", "path", "--resolution",
                        "40x30", "--pixel-samples", "2", "--float", "--denoise", "on", "--light-groups", "--aov",
                        "albedo,normal,direct", "--multi-part"},
                       60)
                .exit_code,
            0);
  ASSERT_EQ(denoise("in.exr", "out.exr").exit_code, 0);
  const ExrLayers in(file("in.exr")), out(file("out.exr"));
  for (const std::string& channel : in.names())
    for (size_t i = 0; i < in[channel].size(); ++i)
      ASSERT_NEAR(out[channel][i], in[channel][i], 1e-5f * std::max(1.0f, std::abs(in[channel][i]))) << channel << i;
}

TEST_F(DenoiseCommand, KnowsTheNamesOfOtherRenderers) {
  const std::vector<float> all = picture();
  const ExrLayers expected = denoised({{"", dapple_names, all}});
  EXPECT_NE(expected["R"], channels_of(all, 0, 1));
  const std::string view = "ViewLayer.", albedo = view + "Denoising Albedo.", normal = view + "Denoising Normal.";
  const std::vector<Names> others = {
      {view + "Combined.R", view + "Combined.G", view + "Combined.B", albedo + "R", albedo + "G", albedo + "B",
       normal + "X", normal + "Y", normal + "Z"},
      {"R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B", "Ns.X", "Ns.Y", "Ns.Z"},
      {"R", "G", "B", "Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z"},
      {"Ci.r", "Ci.g", "Ci.b", "albedo.r", "albedo.g", "albedo.b", "normal.r", "normal.g", "normal.b"},
      {"beauty.red", "beauty.green", "beauty.blue", "denoise_albedo.red", "denoise_albedo.green", "denoise_albedo.blue",
       "N.x", "N.y", "N.z"}};
  for (const Names& names : others) {
    const ExrLayers out = denoised({{"", names, all}});
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(out[names[c]], expected[dapple_names[c]]) << names[c];
    for (size_t c = 3; c < 9; ++c) EXPECT_EQ(out[names[c]], channels_of(all, int(c), 1)) << names[c];
  }
}

TEST_F(DenoiseCommand, TakesManyPartsAndTiles) {
  const std::vector<float> all = picture();
  const ExrLayers expected = denoised({{"", dapple_names, all}});
  const std::vector<std::vector<Part>> files = {
      {{"", dapple_names, all, OIIO::TypeDesc::FLOAT, 16}},
      {{"rgba", {"R", "G", "B"}, channels_of(all, 0, 3)},
       {"albedo", {"R", "G", "B"}, channels_of(all, 3, 3)},
       {"normal", {"X", "Y", "Z"}, channels_of(all, 6, 3)}},
      {{"albedo", {"albedo.R", "albedo.G", "albedo.B"}, channels_of(all, 3, 3), OIIO::TypeDesc::FLOAT, 32},
       {"rgb", {"R", "G", "B"}, channels_of(all, 0, 3), OIIO::TypeDesc::FLOAT, 32},
       {"normal", {"normal.X", "normal.Y", "normal.Z"}, channels_of(all, 6, 3), OIIO::TypeDesc::FLOAT, 32}}};
  for (const auto& parts : files) {
    const ExrLayers out = denoised(parts);
    EXPECT_EQ(out.parts(), int(parts.size()));
    const auto in = OIIO::ImageInput::open(file("out.exr"));
    for (size_t p = 0; p < parts.size(); ++p) {
      ASSERT_TRUE(in->seek_subimage(int(p), 0));
      EXPECT_EQ(in->spec().tile_width, parts[p].tile);
      if (parts[p].channels[0] != "R" || parts[p].name == "albedo") continue;
      std::vector<float> pixels(size_t(width) * height * size_t(in->spec().nchannels));
      ASSERT_TRUE(in->read_image(int(p), 0, 0, -1, OIIO::TypeDesc::FLOAT, pixels.data()));
      const int n = in->spec().nchannels;
      for (int c = 0; c < 3; ++c) EXPECT_EQ(channels_of(pixels, c, 1, n), expected[dapple_names[size_t(c)]]) << p;
    }
  }
}

// Halfs stay halfs, numbers that are none stay as they are, integers and texts too; and what lossy codes had made is
// not coded with loss again.
TEST_F(DenoiseCommand, KeepsAllElseBitForBit) {
  Names names = dapple_names;
  names.insert(names.end(), {"A", "Z", "mask.R"});
  std::vector<float> pixels;
  const std::vector<float> nine = picture();
  for (size_t i = 0; i < nine.size() / 9; ++i) {
    pixels.insert(pixels.end(), &nine[9 * i], &nine[9 * i] + 9);
    pixels.insert(pixels.end(), {noise(int(i), 3, 1), i % 7 ? 1e4f * float(i) : std::numeric_limits<float>::infinity(),
                                 i % 5 ? noise(int(i), 1, 2) : std::nanf("")});
  }
  for (const auto& [type, compression] : {std::pair(OIIO::TypeDesc::HALF, "dwaa"),
                                          {OIIO::TypeDesc::HALF, "b44"},
                                          {OIIO::TypeDesc::FLOAT, "piz"},
                                          {OIIO::TypeDesc::HALF, "zip"}}) {
    Part part{"", names, pixels, type};
    part.compression = compression;
    write_parts(file("in.exr"), {part});
    ASSERT_EQ(denoise("in.exr", "out.exr").exit_code, 0);
    const ExrLayers before(file("in.exr")), after(file("out.exr"));
    EXPECT_EQ(after.text("shot"), "seven");
    for (const std::string& name : names) {
      EXPECT_EQ(after.type(name), before.type(name)) << name;
      const bool same = std::memcmp(after[name].data(), before[name].data(), 4 * before[name].size()) == 0;
      EXPECT_EQ(same, name.size() > 1 || name == "A" || name == "Z") << name << " " << compression;
    }
  }
}

TEST_F(DenoiseCommand, DenoisesEachViewByItsOwnLayers) {
  Names names;
  for (const std::string view : {"a.", "b."})
    for (const char* c : {"Combined.R", "Combined.G", "Combined.B", "Denoising Albedo.R", "Denoising Albedo.G",
                          "Denoising Albedo.B", "Denoising Normal.X", "Denoising Normal.Y", "Denoising Normal.Z"})
      names.push_back(view + c);
  names.insert(names.end(), {"Composite.Combined.R", "Composite.Combined.G", "Composite.Combined.B"});
  const std::vector<float> nine = picture();
  std::vector<float> pixels;
  for (size_t i = 0; i < nine.size(); i += 9) {
    pixels.insert(pixels.end(), &nine[i], &nine[i] + 9);
    for (size_t c = 0; c < 9; ++c) pixels.push_back(c < 3 ? .5f * nine[i + c] : nine[i + c]);
    pixels.insert(pixels.end(), &nine[i], &nine[i] + 3);
  }
  const ExrLayers expected = denoised({{"", dapple_names, nine}}), out = denoised({{"", names, pixels}});
  EXPECT_EQ(out["a.Combined.G"], expected["G"]);
  EXPECT_NE(out["b.Combined.G"], channels_of(nine, 1, 1));
  EXPECT_EQ(out["Composite.Combined.G"], channels_of(nine, 1, 1));
}

TEST_F(DenoiseCommand, DoesSmallAndLongPictures) {
  for (const auto& [w, h] : {std::pair(1, 1), {3, 17}, {2000, 1}}) {
    Part part{"", dapple_names, picture(w, h)};
    part.w = w, part.h = h;
    const ExrLayers out = denoised({part});
    EXPECT_EQ(out.width(), w);
    for (const float v : out["G"]) ASSERT_TRUE(v >= 0 && v < 2) << w << " " << v;
  }
}

// What other renderers call direct light need not be a part of the colour.
TEST_F(DenoiseCommand, DirectLightIsThatOfDapple) {
  Names names = dapple_names;
  names.insert(names.end(), {"direct.R", "direct.G", "direct.B"});
  std::vector<float> pixels;
  const std::vector<float> nine = picture();
  for (size_t i = 0; i < nine.size(); i += 9) {
    pixels.insert(pixels.end(), &nine[i], &nine[i] + 9);
    for (size_t c = 0; c < 3; ++c) pixels.push_back(.5f * nine[i + c]);
  }
  const ExrLayers expected = denoised({{"", dapple_names, nine}});
  Part part{"", names, pixels};
  EXPECT_EQ(denoised({part})["G"], expected["G"]);
  part.software = "Other 1.2";
  EXPECT_EQ(denoised({part})["G"], expected["G"]);
  part.software = "Dapple 0.1";
  EXPECT_NE(denoised({part})["G"], expected["G"]);
}

TEST_F(DenoiseCommand, WindowsOfLayersThatAreNotUsedMayDiffer) {
  Part whole{"rgb", dapple_names, picture()};
  whole.software = "Dapple 0.1";
  for (const std::string name : {"variance", "motion", "direct"}) {
    Part small{name, {name + ".R", name + ".G", name + ".B"}, channels_of(picture(9, 9), 0, 3)};
    small.w = small.h = 9;
    if (name == "direct")
      expect_refused(3, {whole, small}, {"direct", "another data window"});
    else
      EXPECT_EQ(denoised({whole, small}).parts(), 2);
  }
  whole.numbers = {{"dapple/independentSamples", 1.f}, {"dapple/samples", 64.f}};
  Part small{"variance", {"variance.R", "variance.G", "variance.B"}, channels_of(picture(9, 9), 0, 3)};
  small.w = small.h = 9;
  expect_refused(3, {whole, small}, {"variance", "another data window"});
}

TEST_F(DenoiseCommand, ExposuresOfHeadersHaveBounds) {
  Part part{"", dapple_names, picture()};
  const ExrLayers expected = denoised({part});
  for (const float exposure : {1e38f, 1e-38f, -1.f, 0.f, std::nanf("")}) {
    part.numbers = {{"dapple/denoiseExposure", exposure}};
    EXPECT_EQ(denoised({part})["G"], expected["G"]) << exposure;
  }
  part.numbers = {{"dapple/denoiseExposure", .01f}};
  EXPECT_NE(denoised({part})["G"], expected["G"]);
}

TEST_F(DenoiseCommand, SaysWhatIsMissing) {
  const std::vector<float> all = picture();
  expect_refused(3, {{"", {"depth", "albedo.R", "albedo.G", "albedo.B"}, channels_of(all, 2, 4)}},
                 {"no picture to denoise", "\"albedo\""});
  const Names without_normal(dapple_names.begin(), dapple_names.begin() + 6);
  const std::vector<Part> six = {{"", without_normal, channels_of(all, 0, 6)}};
  expect_refused(3, six, {"no layer of normals", "\"albedo\""},
                 {"--weights", source_path("data/denoise/rt_hdr_alb_nrm.tza")});
  // Else by colour alone, which is said.
  write_parts(file("in.exr"), six);
  const ProcessResult alone = denoise("in.exr", "out.exr");
  EXPECT_EQ(alone.exit_code, 0);
  EXPECT_NE(alone.output.find("no layer of normals"), std::string::npos) << alone.output;
  EXPECT_NE(ExrLayers(file("out.exr")).text("dapple/denoised").find("rt_hdr.tza"), std::string::npos);
  Part small{"normal", {"normal.X", "normal.Y", "normal.Z"}, channels_of(picture(9, 9), 6, 3)};
  small.w = small.h = 9;
  expect_refused(3, {{"rgb", without_normal, channels_of(all, 0, 6)}, small}, {"another data window"});
}

TEST_F(DenoiseCommand, SaysWhatIsNotFinite) {
  std::vector<float> all = picture();
  all[9 * 5] = std::nanf("");
  all[9 * 77 + 1] = std::numeric_limits<float>::infinity();
  all[9 * 78 + 4] = std::numeric_limits<float>::infinity();  // of albedo
  write_parts(file("in.exr"), {{"", dapple_names, all}});
  const ProcessResult result = denoise("in.exr", "out.exr");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.output.find("2 pixels of \"R G B\" are not finite"), std::string::npos) << result.output;
  for (const char* c : {"R", "G", "B"})
    for (const float v : ExrLayers(file("out.exr"))[c]) ASSERT_TRUE(std::isfinite(v));
}

TEST_F(DenoiseCommand, RefusesWhatItCannotRead) {
  write_parts(file("in.exr"), {{"", dapple_names, picture()}});
  std::ifstream in(file("in.exr"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const double share : {0.001, .02, .5, .9, .999}) {
    std::ofstream(file("cut.exr"), std::ios::binary) << bytes.substr(0, size_t(double(bytes.size()) * share));
    expect_refused(3, "cut.exr", {"cut.exr"});
  }
  std::ofstream(file("text.exr")) << "This is no image.";
  expect_refused(3, "text.exr", {"not an OpenEXR file"});
  expect_refused(4, "nothing.exr", {"nothing.exr"});
  expect_refused(4, "in.exr", {"nothing.tza"}, {"--weights", file("nothing.tza")});
  EXPECT_EQ(denoise("in.exr", "in.exr").exit_code, 2);
  EXPECT_EQ(denoise("in.exr", "out.png").exit_code, 2);
  EXPECT_EQ(denoise("in.exr", "nowhere/out.exr").exit_code, 4);
}

}  // namespace
}  // namespace dapple::test
