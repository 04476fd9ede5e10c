// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/layer_names.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

namespace dapple::denoise {
namespace {

struct Part {
  std::string name;
  std::vector<std::string> channels;
};

class LayerNames : public testing::Test {
 protected:
  ~LayerNames() override { std::filesystem::remove(path_); }
  /// The depth of the only picture in a file of black parts: "part:channel"; "none".
  std::string depth_of(const std::vector<Part>& parts) const {
    std::vector<OIIO::ImageSpec> specs;
    for (const Part& part : parts) {
      OIIO::ImageSpec spec(2, 2, int(part.channels.size()), OIIO::TypeDesc::FLOAT);
      spec.channelnames = part.channels;
      spec.attribute("oiio:subimagename", part.name);
      specs.push_back(spec);
    }
    const auto out = OIIO::ImageOutput::create("openexr");
    EXPECT_TRUE(out->open(path_, int(specs.size()), specs.data())) << out->geterror();
    for (size_t p = 0; p < parts.size(); ++p) {
      if (p > 0) {
        EXPECT_TRUE(out->open(path_, specs[p], OIIO::ImageOutput::AppendSubimage)) << out->geterror();
      }
      const std::vector<float> black(4 * parts[p].channels.size());
      EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, black.data())) << out->geterror();
    }
    EXPECT_TRUE(out->close());
    const image::ExrFile file(path_);
    const std::vector<Picture> pictures = find_pictures(file);
    EXPECT_EQ(pictures.size(), 1u);
    if (pictures.size() != 1 || !pictures[0].depth) return "none";
    const image::ExrFile::Part& part = file.parts()[pictures[0].depth->part];
    return part.name + ":" + part.channels[pictures[0].depth->channel].name;
  }

 private:
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("dapple-layers-" + std::to_string(getpid()) + ".exr")).string();
};

TEST_F(LayerNames, NormalsHaveNoDepth) {
  const Part colour{"rgb", {"R", "G", "B"}}, normal{"normal", {"X", "Y", "Z"}};
  EXPECT_EQ(depth_of({colour, normal}), "none");
  EXPECT_EQ(depth_of({colour, normal, {"depth", {"Z"}}}), "depth:Z");
  EXPECT_EQ(depth_of({colour, {"other", {"Z"}}, {"depth", {"Z"}}}), "depth:Z");
  EXPECT_EQ(depth_of({colour, {"other", {"Z"}}, {"depth", {"depth.V"}}}), "depth:depth.V");
  EXPECT_EQ(depth_of({{"rgb", {"R", "G", "B", "Z"}}, normal}), "rgb:Z");
}

}  // namespace
}  // namespace dapple::denoise
