// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <functional>

#include "dapple/base/hash.h"
#include "dapple/image/image.h"
#include "dapple/image/texture_system.h"
#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr int width = 13, height = 7;

float ramp(int x, int y, int c) {
  return static_cast<float>(16 * x + 8 * y + c) / 255;
}

/// Portable float map: bottom row first; a negative scale stands for little-endian numbers.
void write_pfm(const std::string& path, int channels) {
  std::string bytes = std::string(channels == 3 ? "PF" : "Pf") + "\n" + std::to_string(width) + " " +
                      std::to_string(height) + "\n-1.0\n";
  for (int y = height - 1; y >= 0; --y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) {
        const float v = ramp(x, y, c);
        bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
      }
  test::write_bytes(path, bytes);
}

/// Writes a ramp whose numbers 8 bits hold exactly.
void write_ramp(const std::string& path, int channels, OIIO::TypeDesc type) {
  if (path.ends_with(".pfm")) return write_pfm(path, channels);
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out) << OIIO::geterror();
  std::vector<float> pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) pixels.push_back(ramp(x, y, c));
  OIIO::ImageSpec spec(width, height, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  ASSERT_TRUE(out->open(path, spec)) << out->geterror();
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data())) << out->geterror();
  ASSERT_TRUE(out->close());
}

struct Format {
  const char* name;
  OIIO::TypeDesc type;
  int channels;
  float tolerance;
  bool srgb;  ///< what automatic means
};
const Format formats[] = {
    {"a.exr", OIIO::TypeDesc::HALF, 3, 1e-3f, false},  {"b.exr", OIIO::TypeDesc::FLOAT, 1, 1e-6f, false},
    {"a.png", OIIO::TypeDesc::UINT8, 3, 1e-6f, true},  {"b.png", OIIO::TypeDesc::UINT16, 1, 1e-5f, true},
    {"a.tga", OIIO::TypeDesc::UINT8, 3, 1e-6f, true},  {"a.hdr", OIIO::TypeDesc::FLOAT, 3, 0.01f, false},
    {"a.pfm", OIIO::TypeDesc::FLOAT, 3, 1e-6f, false}, {"b.pfm", OIIO::TypeDesc::FLOAT, 1, 1e-6f, false},
    {"a.tif", OIIO::TypeDesc::UINT8, 3, 1e-6f, true},  {"b.tif", OIIO::TypeDesc::FLOAT, 3, 1e-6f, false},
    {"a.bmp", OIIO::TypeDesc::UINT8, 3, 1e-6f, true},  {"a.ppm", OIIO::TypeDesc::UINT8, 3, 1e-6f, true},
    {"a.jpg", OIIO::TypeDesc::UINT8, 3, 0.1f, true},   {"a.webp", OIIO::TypeDesc::UINT8, 3, 0.2f, true}};

TEST(ReadImage, EveryFormatComesBackUpright) {
  const TemporaryFolder folder;
  for (const Format& f : formats) {
    SCOPED_TRACE(f.name);
    const std::string path = folder.file(f.name);
    write_ramp(path, f.channels, f.type);
    if (HasFatalFailure()) return;
    const ImageInfo info = read_image_info(path, {});
    EXPECT_EQ(info.width, width);
    EXPECT_EQ(info.height, height);
    EXPECT_EQ(info.channels, f.channels);
    EXPECT_EQ(info.encoding, f.srgb ? Encoding::srgb() : Encoding::linear());
    const Image stored = read_image(path, {}, Encoding::linear()), decoded = read_image(path, {});
    ASSERT_EQ(stored.channels(), f.channels);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < f.channels; ++c) {
          const float v = ramp(x, y, c);
          ASSERT_NEAR(stored.pixel(x, y)[c], v, f.tolerance) << x << " " << y;
          ASSERT_NEAR(decoded.pixel(x, y)[c], f.srgb ? srgb_to_linear(v) : v, f.tolerance * 2 + 1e-5f) << x << " " << y;
        }
  }
}

// OpenEXR: the picture is the display window; the data window is what of it, and beyond it, the file holds.
TEST(ReadImage, ExrIsItsDisplayWindow) {
  struct Windows {
    int x, y, w, h, full_x, full_y, full_w, full_h;
  };
  const TemporaryFolder folder;
  const Windows cases[] = {{2, 1, 4, 3, 0, 0, 8, 6},        // a crop inside
                           {-2, -1, 12, 8, 0, 0, 8, 6},     // overscan
                           {-10, -5, 4, 3, -12, -6, 8, 6},  // negative origins
                           {5, 4, 6, 5, 0, 0, 8, 6},        // partly outside
                           {20, 20, 4, 3, 0, 0, 8, 6},      // outside
                           {3, 4, 8, 6, 3, 4, 8, 6}};       // the same, moved
  for (const Windows& c : cases) {
    SCOPED_TRACE(std::to_string(c.x) + " " + std::to_string(c.full_x));
    const std::string path = folder.file("w.exr");
    OIIO::ImageSpec spec(c.w, c.h, 4, OIIO::TypeDesc::FLOAT);
    spec.x = c.x, spec.y = c.y, spec.full_x = c.full_x, spec.full_y = c.full_y, spec.full_width = c.full_w,
    spec.full_height = c.full_h;
    std::vector<float> data;
    for (int y = c.y; y < c.y + c.h; ++y)
      for (int x = c.x; x < c.x + c.w; ++x) data.insert(data.end(), {float(x), float(y), 1, 1});
    const auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out && out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, data.data()) && out->close());
    const Image image = read_image(path, {});
    const ImageInfo info = read_image_info(path, {});
    ASSERT_EQ(image.width(), c.full_w);
    ASSERT_EQ(image.height(), c.full_h);
    EXPECT_EQ(info.width, c.full_w);
    EXPECT_EQ(info.height, c.full_h);
    for (int j = 0; j < c.full_h; ++j)
      for (int i = 0; i < c.full_w; ++i) {
        const int x = c.full_x + i, y = c.full_y + j;
        const bool inside = x >= c.x && x < c.x + c.w && y >= c.y && y < c.y + c.h;
        const float* const p = image.pixel(i, j);
        EXPECT_EQ(p[0], inside ? float(x) : 0) << i << " " << j;
        EXPECT_EQ(p[1], inside ? float(y) : 0) << i << " " << j;
        EXPECT_EQ(p[3], inside ? 1 : 0) << i << " " << j;
      }
  }
}

TEST(ReadImage, TheContentTellsTheKindNotTheName) {
  const TemporaryFolder folder;
  write_ramp(folder.file("a.png"), 3, OIIO::TypeDesc::UINT8);
  fs::rename(folder.file("a.png"), folder.file("a.jpg"));
  EXPECT_EQ(read_image_info(folder.file("a.jpg"), {}).format, "png");
  EXPECT_EQ(read_image(folder.file("a.jpg"), {}, Encoding::linear()).pixel(1, 0)[0], ramp(1, 0, 0));
}

TEST(ReadImage, AlphaStaysLinear) {
  const TemporaryFolder folder;
  write_ramp(folder.file("a.png"), 4, OIIO::TypeDesc::UINT8);
  const Image image = read_image(folder.file("a.png"), {});
  EXPECT_EQ(image.alpha_channel(), 3);
  EXPECT_NEAR(image.pixel(5, 5)[0], srgb_to_linear(ramp(5, 5, 0)), 1e-6f);
  EXPECT_NEAR(image.pixel(5, 5)[3], ramp(5, 5, 3), 1e-6f);
}

TEST(Encoding, Names) {
  EXPECT_EQ(Encoding::parse("sRGB", {}), Encoding::srgb());
  EXPECT_EQ(Encoding::parse("linear", {}), Encoding::linear());
  EXPECT_EQ(Encoding::parse("gamma 2.2", {}), Encoding::gamma(2.2f));
  for (const char* bad : {"", "gamma", "gamma ", "gamma x", "gamma -1", "gamma 2.2 3", "SRGB8"})
    EXPECT_THROW(Encoding::parse(bad, {}), InputError) << bad;
  for (float v = -1; v < 3; v += 0.01f) EXPECT_NEAR(linear_to_srgb(srgb_to_linear(v)), v, 2e-6f);
  EXPECT_NEAR(srgb_to_linear(0.5f), 0.2140411f, 1e-6f);
}

TEST(ReadImage, WhatIsNoFileIsRefused) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("folder.png"));
  mkfifo(folder.file("pipe.png").c_str(), 0600);
  test::write_bytes(folder.file("empty.exr"), "");
  test::write_bytes(folder.file("text.png"), "hello, I am no picture");
  for (const std::string& path :
       {folder.file("none.png"), folder.file("folder.png"), folder.file("pipe.png"), folder.file("empty.exr"),
        folder.file("text.png"), std::string("/dev/zero"), std::string("/dev/null"), std::string()}) {
    try {
      read_image(path, {"scene.pbrt", 3, 5});
      ADD_FAILURE() << path << " was read";
    } catch (const InputError& e) {
      EXPECT_TRUE(std::string(e.what()).starts_with("scene.pbrt:3:5: ")) << e.what();
    }
  }
}

TEST(ReadImage, LimitsHold) {
  const TemporaryFolder folder;
  write_ramp(folder.file("a.exr"), 3, OIIO::TypeDesc::HALF);
  ImageLimits limits;
  limits.max_side = width - 1;
  EXPECT_THROW(read_image(folder.file("a.exr"), {}, {}, limits), InputError);
  limits = {};
  limits.max_channels = 2;
  EXPECT_THROW(read_image(folder.file("a.exr"), {}, {}, limits), InputError);
  limits = {};
  limits.max_bytes = 100;
  EXPECT_THROW(read_image(folder.file("a.exr"), {}, {}, limits), InputError);
  limits = {};
  limits.slack_bytes = 0;
  EXPECT_NO_THROW(read_image(folder.file("a.exr"), {}, {}, limits));
  limits.max_expansion = 1;
  EXPECT_THROW(read_image(folder.file("a.exr"), {}, {}, limits), InputError);
}

/// Caps the memory of this process while it lives: a hostile file must do with 1 GiB more than there is.
class MemoryCap {
 public:
  MemoryCap() {
    getrlimit(RLIMIT_DATA, &old_);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    rlimit cap = old_;
    cap.rlim_cur = rlim_t{3} << 29;
    setrlimit(RLIMIT_DATA, &cap);
#endif
  }
  ~MemoryCap() {
    setrlimit(RLIMIT_DATA, &old_);
  }

 private:
  rlimit old_{};
};

/// True if the body ends or throws InputError, soon. (A crash ends the test program, which is as plain.)
testing::AssertionResult survives(const std::function<void()>& body, double seconds = 5) {
  const MemoryCap cap;
  const auto start = std::chrono::steady_clock::now();
  try {
    body();
  } catch (const InputError&) {
  } catch (const std::exception& e) {
    return testing::AssertionFailure() << "not an InputError: " << e.what();
  }
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (took > seconds) return testing::AssertionFailure() << "took " << took << " s";
  return testing::AssertionSuccess();
}

void use_everywhere(const std::string& path) {
  EXPECT_TRUE(survives([&] { read_image_info(path, {}); })) << path;
  EXPECT_TRUE(survives([&] { read_image(path, {}); })) << path;
  EXPECT_TRUE(survives([&] {
    TextureSystem system;
    const TextureHandle t = system.open(path, Encoding::automatic(), TextureUse::color, {});
    const float s[2] = {0.1f, 0.9f}, w[2] = {0, 0.3f};
    float out[6];
    t.lookup({2, s, s, w, w, w, w}, {}, 3, out);
  })) << path;
}

TEST(DamagedImages, OfTheSharedCollection) {
  const fs::path bad = fs::path(DAPPLE_SHARED_DIR) / "scenes/bad";
  if (!fs::exists(bad)) GTEST_SKIP() << "no collection of damaged images at " << bad;
  const TemporaryFolder folder;
  int images = 0;
  for (const auto& entry : fs::directory_iterator(bad / "exr")) {
    const std::string path = folder.file(std::to_string(images++) + ".exr");
    fs::copy_file(entry.path(), path);
    use_everywhere(path);
    EXPECT_TRUE(survives([&] { read_image(entry.path().string(), {}); })) << entry.path();
  }
  for (const auto& entry : fs::directory_iterator(bad))
    if (entry.path().extension() == ".png") {
      ++images;
      use_everywhere(entry.path().string());
      EXPECT_THROW(read_image(entry.path().string(), {}), InputError) << entry.path();
    }
  EXPECT_GT(images, 20);
}

/// A 1.3 GB comment in a file of 200 bytes, a picture of 2^31 lines, a tile of 2^40 pixels: no memory may be taken for
/// them.
TEST(DamagedImages, ExrHeadersThatClaimTooMuch) {
  const TemporaryFolder folder;
  const auto number = [](uint32_t v) { return std::string(reinterpret_cast<const char*>(&v), 4); };
  const auto attribute = [&](const std::string& name, const std::string& type, uint32_t size, const std::string& data) {
    return name + '\0' + type + '\0' + number(size) + data;
  };
  const auto box = [&](uint32_t x1, uint32_t y1) { return number(0) + number(0) + number(x1) + number(y1); };
  const std::string start("\x76\x2f\x31\x01\x02\0\0\0", 8),
      channels = attribute("channels", "chlist", 1, std::string(1, 0));
  const std::string one_channel =
      attribute("channels", "chlist", 19, std::string("R\0", 2) + number(1) + number(0) + number(1) + number(1) + '\0');
  const std::string window = attribute("dataWindow", "box2i", 16, box(15, 15)), rest(100, '\0');
  const std::string files[] = {
      start + attribute("comments", "string", 0x50000000, "long") + rest,
      start + one_channel + attribute("dataWindow", "box2i", 16, box(15, 0x7fffffff)) + rest,
      start + one_channel + attribute("dataWindow", "box2i", 16, box(0x80000000, 5)) + rest,
      start + one_channel + attribute("dataWindow", "box2i", 16, box(60000, 60000)) + rest,
      start + one_channel + window + attribute("tiles", "tiledesc", 9, number(1 << 20) + number(1 << 20) + '\0') + rest,
      start + channels + window + rest,
      start + std::string(1000, 'a'),
      start + attribute("x", "string", 0xffffffff, "") + rest};
  for (const std::string& bytes : files) {
    test::write_bytes(folder.file("a.exr"), bytes);
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    EXPECT_THROW(read_image(folder.file("a.exr"), {}), InputError);
    getrusage(RUSAGE_SELF, &after);
    EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 50 << 10);  // KiB
  }
}

/// libpng takes the memory of a chunk, here of text and of 2 GB, before it finds that the file ends.
TEST(DamagedImages, PngChunksThatClaimTooMuch) {
  const TemporaryFolder folder;
  write_ramp(folder.file("a.png"), 3, OIIO::TypeDesc::UINT8);
  const std::string whole = test::read_bytes(folder.file("a.png"));
  constexpr size_t first = 33;  // behind the signature and IHDR
  const std::string lie = std::string("\x7f\xff\x00\x08tEXt", 8) + "Comment" + std::string(5, '\0');
  test::write_bytes(folder.file("lie.png"), whole.substr(0, first) + lie + whole.substr(first));
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  try {
    read_image(folder.file("lie.png"), {"scene", 1, 2});
    FAIL() << "the chunk was believed";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("lie.png\" is damaged: its chunk tEXt at byte 33 claims 2147418120 bytes"),
              std::string::npos)
        << e.what();
  }
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 50 << 10);  // KiB
  test::write_bytes(folder.file("more.png"), whole + lie);  // behind the image anything may stand
  EXPECT_NO_THROW(read_image(folder.file("more.png"), {}));
}

/// Every format cut short at many places, and with bytes changed: an InputError or some picture, nothing else.
TEST(DamagedImages, CutAndChanged) {
  const TemporaryFolder folder;
  for (const Format& f : formats) {
    SCOPED_TRACE(f.name);
    write_ramp(folder.file(f.name), f.channels, f.type);
    const std::string whole = test::read_bytes(folder.file(f.name));
    const std::string path = folder.file(std::string("bad-") + f.name);
    const double seconds = 60;
    EXPECT_TRUE(survives(
        [&] {
          for (size_t n = 0; n < whole.size(); n += 1 + whole.size() / 100) {
            test::write_bytes(path, whole.substr(0, n));
            try {
              read_image(path, {});
            } catch (const InputError&) {
            }
          }
        },
        seconds));
    EXPECT_TRUE(survives(
        [&] {
          for (int i = 0; i < 100; ++i) {
            KeyedRng rng(static_cast<uint64_t>(i));
            std::string bytes = whole;
            for (int k = 0; k < 3; ++k)
              bytes[rng.next_bits() % std::min<size_t>(bytes.size(), k < 2 ? 200 : bytes.size())] =
                  static_cast<char>(rng.next_bits());
            test::write_bytes(path, bytes);
            try {
              read_image(path, {});
            } catch (const InputError&) {
            }
          }
        },
        seconds));
  }
}

TEST(DamagedImages, TruncationIsNoticed) {
  const TemporaryFolder folder;
  for (const Format& f : formats) {
    SCOPED_TRACE(f.name);
    const std::string path = folder.file(f.name);
    write_ramp(path, f.channels, f.type);
    const std::string whole = test::read_bytes(path);
    const Image expected = read_image(path, {});
    // What is cut off may be a trailer that holds no picture; then all of the picture must be there.
    for (const double part : {0.3, 0.6, 0.9}) {
      test::write_bytes(path, whole.substr(0, static_cast<size_t>(part * static_cast<double>(whole.size()))));
      try {
        const Image image = read_image(path, {});
        EXPECT_TRUE(std::equal(image.pixels().begin(), image.pixels().end(), expected.pixels().begin(),
                               expected.pixels().end()))
            << part;
      } catch (const InputError&) {
      }
    }
  }
}

}  // namespace
}  // namespace dapple::image
