// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/image_writer.h"

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "dapple/base/hash.h"
#include "dapple/image/atomic_file.h"
#include "dapple/image/mip_pyramid.h"
#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

using test::read_bytes;
using test::TemporaryFolder;

/// Every number differs and is exact in half precision.
ImageLayer make_layer(const std::string& name, std::vector<std::string> channels, int width, int height, float first) {
  ImageLayer layer{name, std::move(channels), {}, {}};
  for (size_t i = 0; i < layer.channels.size() * width * height; ++i)
    layer.pixels.push_back(first + static_cast<float>(i % 1024) * 0.25f);
  return layer;
}

OutputImage make_picture(int width, int height) {
  OutputImage image;
  image.width = width;
  image.height = height;
  image.layers = {make_layer("", {"R", "G", "B"}, width, height, 0),
                  make_layer("normal", {"normal.X", "normal.Y", "normal.Z"}, width, height, -100),
                  make_layer("depth", {"Z"}, width, height, 7), make_layer("samples", {"samples"}, width, height, 3)};
  return image;
}

void expect_same_layers(const std::string& path, const OutputImage& expected, bool multi_part) {
  const auto in = OIIO::ImageInput::open(path);
  ASSERT_TRUE(in) << OIIO::geterror();
  for (size_t l = 0; l < expected.layers.size(); ++l) {
    const ImageLayer& layer = expected.layers[l];
    const int part = multi_part ? static_cast<int>(l) : 0;
    const OIIO::ImageSpec spec = in->spec(part);
    ASSERT_EQ(spec.width, expected.width);
    ASSERT_EQ(spec.height, expected.height);
    std::vector<float> pixels(static_cast<size_t>(spec.width) * spec.height * spec.nchannels);
    ASSERT_TRUE(in->read_image(part, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, pixels.data())) << in->geterror();
    for (size_t c = 0; c < layer.channels.size(); ++c) {
      const int at = spec.channelindex(layer.channels[c]);
      ASSERT_GE(at, 0) << layer.channels[c];
      for (size_t i = 0; i < pixels.size() / spec.nchannels; ++i)
        ASSERT_EQ(pixels[i * spec.nchannels + at], layer.pixels[i * layer.channels.size() + c])
            << layer.channels[c] << i;
    }
  }
}

TEST(ExrWriter, LayersComeBackInEveryArrangement) {
  const TemporaryFolder folder;
  for (const bool multi_part : {false, true})
    for (const int tile : {0, 16})
      for (const SampleType type : {SampleType::half_float, SampleType::full_float}) {
        SCOPED_TRACE(testing::Message() << "parts " << multi_part << ", tile " << tile << ", float "
                                        << (type == SampleType::full_float));
        const OutputImage image = make_picture(37, 21);
        ExrOptions options;
        options.multi_part = multi_part;
        options.tile_size = tile;
        options.type = type;
        write_exr(folder.file("a.exr"), image, options);
        expect_same_layers(folder.file("a.exr"), image, multi_part);
      }
}

TEST(ExrWriter, LayerTypesAreKeptApart) {
  const TemporaryFolder folder;
  for (const bool multi_part : {false, true}) {
    OutputImage image = make_picture(8, 8);
    image.layers[2].type = SampleType::full_float;
    image.layers[2].pixels[5] = 123456.789f;  // neither in half's range nor of its precision
    image.layers[0].pixels[4] = 1e9f;         // beyond half: its largest
    ExrOptions options;
    options.multi_part = multi_part;
    write_exr(folder.file("a.exr"), image, options);
    image.layers[0].pixels[4] = 65504;
    expect_same_layers(folder.file("a.exr"), image, multi_part);
  }
}

TEST(ExrWriter, CropsKeepTheDisplayWindow) {
  const TemporaryFolder folder;
  for (const bool multi_part : {false, true}) {
    OutputImage image = make_picture(10, 6);
    image.origin = {30, 20};
    image.display_width = 100;
    image.display_height = 80;
    ExrOptions options;
    options.multi_part = multi_part;
    write_exr(folder.file("crop.exr"), image, options);
    expect_same_layers(folder.file("crop.exr"), image, multi_part);
    const auto in = OIIO::ImageInput::open(folder.file("crop.exr"));
    ASSERT_TRUE(in);
    EXPECT_EQ(in->spec().x, 30);
    EXPECT_EQ(in->spec().y, 20);
    EXPECT_EQ(in->spec().full_x, 0);
    EXPECT_EQ(in->spec().full_y, 0);
    EXPECT_EQ(in->spec().full_width, 100);
    EXPECT_EQ(in->spec().full_height, 80);
  }
}

TEST(ExrWriter, MetadataAndCompression) {
  const TemporaryFolder folder;
  OutputImage image = make_picture(8, 8);
  image.metadata = {{"dapple:scene", std::string("forest")}, {"dapple:samples", 64}, {"dapple:seconds", 1.5f}};
  ExrOptions options;
  options.compression = "piz";
  write_exr(folder.file("m.exr"), image, options);
  const auto in = OIIO::ImageInput::open(folder.file("m.exr"));
  ASSERT_TRUE(in);
  EXPECT_EQ(in->spec().get_string_attribute("dapple:scene"), "forest");
  EXPECT_EQ(in->spec().get_int_attribute("dapple:samples"), 64);
  EXPECT_EQ(in->spec().get_float_attribute("dapple:seconds"), 1.5f);
  EXPECT_EQ(in->spec().get_string_attribute("compression"), "piz");
  options.compression = "best";
  EXPECT_THROW(write_exr(folder.file("m.exr"), image, options), UsageError);
}

TEST(ImageWriter, SamePictureGivesSameBytesAndNoDate) {
  const TemporaryFolder folder;
  const OutputImage image = make_picture(64, 64);
  write_image(folder.file("a.exr"), image);
  write_image(folder.file("a.png"), image);
  sleep(1);  // a date would have changed by now
  write_image(folder.file("b.exr"), image);
  write_image(folder.file("b.png"), image);
  EXPECT_TRUE(read_bytes(folder.file("a.exr")) == read_bytes(folder.file("b.exr")));
  EXPECT_TRUE(read_bytes(folder.file("a.png")) == read_bytes(folder.file("b.png")));
  EXPECT_EQ(OIIO::ImageInput::open(folder.file("a.exr"))->spec().get_string_attribute("DateTime"), "");
}

OutputImage grey_ramp() {
  OutputImage image;
  image.width = 5;
  image.height = 1;
  ImageLayer layer{"", {"R", "G", "B"}, {}, {}};
  for (const float v : {-1.0f, 0.0f, 0.2140411f, 1.0f, 50.0f}) layer.pixels.insert(layer.pixels.end(), 3, v);
  image.layers = {layer};
  return image;
}

TEST(PngWriter, SrgbIsBuiltIn) {
  const TemporaryFolder folder;
  for (const int bits : {8, 16}) {
    write_png(folder.file("g.png"), grey_ramp(), {{}, bits});
    const Image stored = read_image(folder.file("g.png"), {}, Encoding::linear());
    ASSERT_EQ(stored.width(), 5);
    const float expected[] = {0, 0, 0.5f, 1, 1};
    for (int x = 0; x < 5; ++x) EXPECT_NEAR(stored.rgb(x, 0).g, expected[x], bits == 8 ? 0.5 / 255 : 1e-5) << x;
    EXPECT_NEAR(read_image(folder.file("g.png"), {}).rgb(2, 0).g, 0.214f, bits == 8 ? 0.005f : 1e-4f);
  }
}

TEST(PngWriter, AlphaIsNotMultipliedIn) {
  const TemporaryFolder folder;
  OutputImage image;
  image.width = image.height = 1;
  image.layers = {{"", {"R", "G", "B", "A"}, {0.25f, 0.125f, 0, 0.5f}, {}}};
  write_png(folder.file("a.png"), image, {{}, 16});
  const Image back = read_image(folder.file("a.png"), {});
  ASSERT_EQ(back.channels(), 4);
  EXPECT_NEAR(back.pixel(0, 0)[0], 0.5f, 1e-4f);
  EXPECT_NEAR(back.pixel(0, 0)[1], 0.25f, 1e-4f);
  EXPECT_NEAR(back.pixel(0, 0)[3], 0.5f, 1e-4f);
}

TEST(PngWriter, OpenColorIoViews) {
  const TemporaryFolder folder;
  // A configuration whose only view inverts nothing but scales by one half: told apart from sRGB at once.
  test::write_bytes(folder.file("half.ocio"), R"(ocio_profile_version: 1
roles:
  scene_linear: lin
  default: lin
displays:
  monitor:
    - !<View> {name: dim, colorspace: half}
active_displays: []
active_views: []
colorspaces:
  - !<ColorSpace>
    name: lin
  - !<ColorSpace>
    name: half
    from_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
)");
  PngOptions options;
  options.view = {"", "dim", folder.file("half.ocio")};
  write_png(folder.file("v.png"), grey_ramp(), options);
  const Image stored = read_image(folder.file("v.png"), {}, Encoding::linear());
  EXPECT_NEAR(stored.rgb(3, 0).r, 0.5f, 1.0f / 255);
  EXPECT_NEAR(stored.rgb(2, 0).r, 0.107f, 1.0f / 255);
  EXPECT_EQ(stored.rgb(4, 0).r, 1);

  options.view.view = "bright";
  try {
    write_png(folder.file("w.png"), grey_ramp(), options);
    FAIL() << "an unknown view was accepted";
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("dim"), std::string::npos) << e.what();
  }
  options.view.config = folder.file("absent.ocio");
  EXPECT_THROW(write_png(folder.file("w.png"), grey_ramp(), options), Error);
  EXPECT_FALSE(std::filesystem::exists(folder.file("w.png")));
}

TEST(ImageWriter, ImpossiblePathsAreNamed) {
  const TemporaryFolder folder;
  const OutputImage image = make_picture(4, 4);
  for (const char* name : {"a", "a.gif", "a.exr.part"}) {
    EXPECT_THROW(write_image(folder.file(name), image), UsageError) << name;
    EXPECT_THROW(check_writable(folder.file(name)), UsageError) << name;
  }
  std::filesystem::create_directory(folder.file("folder.exr"));
  for (const char* name : {"missing/a.exr", "folder.exr"}) {
    EXPECT_THROW(write_image(folder.file(name), image), IoError) << name;
    EXPECT_THROW(check_writable(folder.file(name)), IoError) << name;
  }
  EXPECT_NO_THROW(check_writable(folder.file("fine.png")));
  if (geteuid() != 0) {
    std::filesystem::create_directory(folder.file("locked"));
    chmod(folder.file("locked").c_str(), 0500);
    EXPECT_THROW(write_image(folder.file("locked/a.exr"), image), IoError);
    chmod(folder.file("locked").c_str(), 0700);
  }
}

/// A full disk, as far as a process can have one of its own.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    rlimit limit = old_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit old_{};
  void (*handler_)(int);
};

TEST(ImageWriter, FailuresLeaveTheOldFileAndNoRest) {
  const TemporaryFolder folder;
  const OutputImage small = make_picture(4, 4);
  for (const char* name : {"a.exr", "a.png"}) write_image(folder.file(name), small);
  OutputImage noise = make_picture(256, 256);
  for (ImageLayer& layer : noise.layers)
    for (size_t i = 0; i < layer.pixels.size(); ++i) layer.pixels[i] = to_unit_float(mix(i));
  for (const char* name : {"a.exr", "a.png"}) {
    const std::string before = read_bytes(folder.file(name));
    {
      const FileSizeLimit limit(20000);
      EXPECT_THROW(write_image(folder.file(name), noise), IoError) << name;
    }
    EXPECT_TRUE(read_bytes(folder.file(name)) == before) << name;
    write_image(folder.file(name), noise);
    EXPECT_GT(read_bytes(folder.file(name)).size(), 20000u);
  }
  EXPECT_EQ(folder.names().size(), 2u);
}

// Rationale: OpenEXR's tiled writers wait without end where writing goes on after an error. The limit is passed within
// the second row of tiles.
TEST(ImageWriter, FailuresInLaterTilesEnd) {
  const TemporaryFolder folder;
  OutputImage noise = make_picture(256, 256);
  for (ImageLayer& layer : noise.layers)
    for (size_t i = 0; i < layer.pixels.size(); ++i) layer.pixels[i] = to_unit_float(mix(i));
  Image texture(256, 256, 3);
  for (size_t i = 0; i < texture.pixels().size(); ++i) texture.pixels()[i] = to_unit_float(mix(i));
  const FileSizeLimit limit(100000);
  for (const bool multi_part : {false, true})
    EXPECT_THROW(write_exr(folder.file("a.exr"), noise, {.multi_part = multi_part, .tile_size = 64}), IoError)
        << multi_part;
  EXPECT_TRUE(folder.names().empty());
  EXPECT_THROW(write_mip_pyramid(folder.file("texture.exr"), texture, SampleType::half_float), IoError);
}

// Rationale: a file beside the output is the user's, whatever its name, and two processes may write to one name.
TEST(ImageWriter, PartsTakeNoNameOfOthers) {
  const TemporaryFolder folder;
  const OutputImage image = make_picture(4, 4);
  const auto write = [](const std::string& path, const char* text) {
    AtomicFile file(path);
    file.write(text, 3);
    return file.part_path();
  };
  const std::string last = write(folder.file("a.exr"), "old");  // and gone: it was not committed
  EXPECT_TRUE(folder.names().empty());
  mkfifo(last.c_str(), 0600);
  std::ofstream(folder.file("a.exr.part")) << "mine";
  for (const bool multi_part : {false, true}) write_exr(folder.file("a.exr"), image, {.multi_part = multi_part});
  EXPECT_EQ(read_bytes(folder.file("a.exr.part")), "mine");
  EXPECT_TRUE(std::filesystem::is_fifo(last));
  EXPECT_EQ(folder.names().size(), 3u);

  AtomicFile one(folder.file("b.txt")), two(folder.file("b.txt"));
  one.write("one", 3), two.write("two", 3);
  one.commit();
  EXPECT_EQ(read_bytes(folder.file("b.txt")), "one");
  two.commit();
  EXPECT_EQ(read_bytes(folder.file("b.txt")), "two");
  EXPECT_EQ(folder.names().size(), 4u);

  write_png(folder.file(std::string(251, 'n') + ".png"), image);  // the longest name there is
  const mode_t mask = umask(027);
  write_png(folder.file("c.png"), image);
  umask(mask);
  struct stat s {};
  ASSERT_EQ(stat(folder.file("c.png").c_str(), &s), 0);
  EXPECT_EQ(s.st_mode & 0777, 0640u);
}

TEST(ImageWriter, WrongPicturesAreRefused) {
  const TemporaryFolder folder;
  OutputImage image = make_picture(4, 4);
  image.layers[1].pixels.pop_back();
  EXPECT_THROW(write_image(folder.file("a.exr"), image), UsageError);
  image = make_picture(4, 4);
  image.layers[1].channels[0] = "R";
  EXPECT_THROW(write_image(folder.file("a.exr"), image), UsageError);
  EXPECT_THROW(write_image(folder.file("a.exr"), OutputImage{}), UsageError);
  EXPECT_TRUE(folder.names().empty());
}

}  // namespace
}  // namespace dapple::image
