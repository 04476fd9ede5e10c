// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/texture_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <thread>

#include "dapple/base/hash.h"
#include "dapple/image/image_writer.h"
#include "dapple/image/mip_pyramid.h"
#include "dapple/image/temporary_folder.h"
#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

/// Points and footprints for look-ups, filled by a function of the index.
struct Points {
  std::vector<float> s, t, dsdx, dtdx, dsdy, dtdy;
  void add(float s_, float t_, float width = 0) {
    s.push_back(s_), t.push_back(t_);
    dsdx.push_back(width), dtdx.push_back(0), dsdy.push_back(0), dtdy.push_back(width);
  }
  TextureCoordinates view(bool footprint = true) const {
    TextureCoordinates c;
    c.count = static_cast<int>(s.size());
    c.s = s.data(), c.t = t.data();
    if (footprint) c.dsdx = dsdx.data(), c.dtdx = dtdx.data(), c.dsdy = dsdy.data(), c.dtdy = dtdy.data();
    return c;
  }
};

std::vector<float> look_up(const TextureHandle& texture, const Points& points, const TextureSampling& sampling = {},
                           int channels = 1, bool footprint = true) {
  std::vector<float> out(points.s.size() * channels, -1);
  texture.lookup(points.view(footprint), sampling, channels, out.data());
  return out;
}

float look_up(const TextureHandle& texture, float s, float t, float width = 0, const TextureSampling& sampling = {}) {
  Points p;
  p.add(s, t, width);
  return look_up(texture, p, sampling)[0];
}

Image make_image(int width, int height, int channels, const std::function<float(int, int, int)>& f) {
  Image image(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) image.pixel(x, y)[c] = f(x, y, c);
  return image;
}

OutputImage to_output(const Image& image) {
  OutputImage out;
  out.width = image.width();
  out.height = image.height();
  out.layers = {{"", image.channel_names(), {image.pixels().begin(), image.pixels().end()}, {}}};
  return out;
}

/// Large images go through OpenImageIO's cache, small ones are also held whole: tests look at both.
constexpr int small = 64, large = 1536;

constexpr TextureFilter all_filters[] = {TextureFilter::point, TextureFilter::bilinear, TextureFilter::trilinear,
                                         TextureFilter::ewa};

TEST(TextureSystem, SrgbIsDecodedBeforeFiltering) {
  const test::TemporaryFolder folder;
  for (const int size : {small, large}) {
    write_png(folder.file("checker.png"),
              to_output(make_image(size, size, 3, [](int x, int y, int) { return (x + y) % 2; })));
    TextureSystem system;
    for (const TextureUse use : {TextureUse::color, TextureUse::scalar}) {
      const TextureHandle texture = system.open(folder.file("checker.png"), Encoding::automatic(), use, {});
      for (const TextureFilter filter : all_filters)
        for (const float width : {0.05f, 0.3f, 1.0f, 100.0f}) {
          if (width * size < 2) continue;
          // The mean of encoded values would be .5 encoded, .214 linear.
          EXPECT_NEAR(look_up(texture, 0.3f, 0.7f, width, {Wrap::repeat, filter}), 0.5f, 1e-3f) << size << " " << width;
        }
    }
  }
}

TEST(TextureSystem, EncodingsAreApplied) {
  const test::TemporaryFolder folder;
  // Two tones, so that the image does not count as constant.
  write_png(folder.file("tones.png"),
            to_output(make_image(8, 8, 1, [](int x, int, int) { return x < 4 ? 0.2140411f : 0.0f; })));
  TextureSystem system;
  const auto value = [&](Encoding e) {
    return look_up(system.open(folder.file("tones.png"), e, TextureUse::scalar, {}), 0.2f, 0.5f);
  };
  EXPECT_NEAR(value(Encoding::automatic()), 0.214f, 0.003f);
  EXPECT_NEAR(value(Encoding::srgb()), 0.214f, 0.003f);
  EXPECT_NEAR(value(Encoding::linear()), 0.5f, 0.003f);
  EXPECT_NEAR(value(Encoding::gamma(2)), 0.25f, 0.003f);
}

TEST(TextureSystem, TheOriginIsTheLowerLeftCorner) {
  // s from left to right, t from bottom to top: value = s + 10 t at texel centres.
  for (const int size : {small, large}) {
    TextureSystem system;
    const TextureHandle texture = system.add(
        make_image(size, size, 1, [&](int x, int y, int) { return (x + 0.5f) / size + 10 * (1 - (y + 0.5f) / size); }),
        TextureUse::scalar, "ramp");
    for (const TextureFilter filter : all_filters)
      for (const float width : {0.0f, 0.004f})
        for (const float s : {0.2f, 0.8f})
          for (const float t : {0.15f, 0.9f})
            EXPECT_NEAR(look_up(texture, s, t, width, {Wrap::clamp, filter}), s + 10 * t,
                        filter == TextureFilter::point || width > 0 ? 0.2f : 2e-4f)
                << size;
  }
}

TEST(TextureSystem, WrapModes) {
  for (const int size : {small, large}) {
    TextureSystem system;
    const TextureHandle texture =
        system.add(make_image(size, size, 1, [&](int x, int, int) { return x < size / 2 ? 1.0f : 0.25f; }),
                   TextureUse::scalar, "halves");
    for (const TextureFilter filter : all_filters)
      for (const float width : {0.0f, 0.01f}) {
        const auto at = [&](float s, float t, Wrap wrap) { return look_up(texture, s, t, width, {wrap, filter}); };
        EXPECT_EQ(at(1.25f, 0.5f, Wrap::repeat), 1);
        EXPECT_EQ(at(-0.25f, 7.5f, Wrap::repeat), 0.25f);
        EXPECT_EQ(at(1e6f + 0.25f, -1e6f, Wrap::repeat), 1);
        EXPECT_EQ(at(1.25f, 0.5f, Wrap::clamp), 0.25f);
        EXPECT_EQ(at(-3, 2, Wrap::clamp), 1);
        EXPECT_EQ(at(1e9f, 0.5f, Wrap::clamp), 0.25f);
        EXPECT_EQ(at(1.25f, 0.5f, Wrap::black), 0);
        EXPECT_EQ(at(0.25f, -0.25f, Wrap::black), 0);
        EXPECT_EQ(at(-1e9f, 0.5f, Wrap::black), 0);
        EXPECT_EQ(at(0.25f, 0.25f, Wrap::black), 1);
      }
  }
}

TEST(TextureSystem, OddCoordinatesAreHarmless) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const int size : {small, large}) {
    TextureSystem system;
    const TextureHandle texture =
        system.add(make_image(size, size, 1, [](int x, int, int) { return static_cast<float>(x % 2); }),
                   TextureUse::scalar, "stripes");
    for (const TextureFilter filter : all_filters)
      for (const Wrap wrap : {Wrap::repeat, Wrap::black, Wrap::clamp})
        for (const float bad : {nan, inf, -inf, 3e38f, -3e38f}) {
          Points p;
          p.add(bad, 0.5f, 0.1f);
          p.add(0.5f, bad, 0);
          p.add(0.5f, 0.5f, bad);
          for (const float v : look_up(texture, p, {wrap, filter}))
            EXPECT_TRUE(v >= 0 && v <= 1) << v << " for " << bad;
        }
  }
}

TEST(TextureSystem, ResidentAndCachedLookUpsAgree) {
  const auto noise = [](int x, int y, int c) { return to_unit_float(hash(x, y, c)); };
  // The same texels, once small enough to be held whole, once as a corner of a larger image.
  const Image a = make_image(512, 512, 3, noise);
  const Image b = make_image(2048, 512, 3, [&](int x, int y, int c) { return noise(x % 512, y, c); });
  TextureSystem system;
  const TextureHandle ta = system.add(a, TextureUse::color, "a"), tb = system.add(b, TextureUse::color, "b");
  EXPECT_GT(system.statistics().resident_bytes, 0u);
  EXPECT_EQ(system.statistics().resident_bytes, sizeof(float) * 3 * 512 * 512);
  for (const TextureFilter filter : all_filters) {
    Points pa, pb;
    KeyedRng rng(5);
    for (int i = 0; i < 2000; ++i) {
      const float s = rng.next(), t = rng.next();
      pa.add(s, t);
      pb.add(s / 4, t);
    }
    const auto va = look_up(ta, pa, {Wrap::repeat, filter}, 3), vb = look_up(tb, pb, {Wrap::repeat, filter}, 3);
    int differ = 0;
    for (size_t i = 0; i < va.size(); ++i) differ += std::abs(va[i] - vb[i]) > 1e-3f;
    // Round-off moves a few nearest texels.
    EXPECT_LE(differ, filter == TextureFilter::point ? 12 : 0);
  }
}

TEST(TextureSystem, ChannelsByUse) {
  TextureSystem system;
  const Image opaque = make_image(8, 8, 4, [](int x, int, int c) {
    return c == 3 ? 1.0f : c == 0 ? 0.5f * (x < 4) : c * 0.25f;
  });
  const Image cutout = make_image(8, 8, 4, [](int x, int, int c) { return c == 3 ? (x < 4 ? 1.0f : 0.0f) : 0.125f; });
  const Image mask = make_image(8, 8, 1, [](int x, int, int) { return x < 4 ? 1.0f : 0.0f; });
  const Image grey = make_image(8, 8, 3, [](int x, int, int) { return x * 0.125f; });

  const TextureHandle color = system.add(opaque, TextureUse::color, "opaque");
  EXPECT_EQ(color.channels(), 3);
  Points p;
  p.add(0.25f, 0.5f);
  EXPECT_EQ(look_up(color, p, {}, 3), (std::vector<float>{0.5f, 0.25f, 0.5f}));
  EXPECT_FLOAT_EQ(look_up(system.add(opaque, TextureUse::scalar, "opaque"), 0.25f, 0.5f), 1.25f / 3);
  EXPECT_FLOAT_EQ(look_up(color, 0.25f, 0.5f), 1.25f / 3);

  EXPECT_EQ(system.add(cutout, TextureUse::scalar, "cutout").channels(), 1);
  EXPECT_EQ(look_up(system.add(cutout, TextureUse::scalar, "cutout"), 0.25f, 0.5f), 1);
  EXPECT_EQ(look_up(system.add(cutout, TextureUse::scalar, "cutout"), 0.75f, 0.5f), 0);
  EXPECT_EQ(look_up(system.add(cutout, TextureUse::color, "cutout"), 0.75f, 0.5f), 0.125f);
  EXPECT_EQ(system.add(mask, TextureUse::color, "mask").channels(), 1);
  EXPECT_EQ(look_up(system.add(mask, TextureUse::color, "mask"), p, {}, 3), (std::vector<float>{1, 1, 1}));
  EXPECT_EQ(system.add(grey, TextureUse::color, "grey").channels(), 1);
}

TEST(TextureSystem, ConstantImagesAreKnown) {
  TextureSystem system;
  const TextureHandle t =
      system.add(make_image(100, 100, 3, [](int, int, int c) { return 0.25f * c; }), TextureUse::color, "flat");
  ASSERT_TRUE(t.constant());
  EXPECT_EQ(*t.constant(), (std::array<float, 3>{0, 0.25f, 0.5f}));
  Points p;
  p.add(3.7f, -2, 0.1f);
  EXPECT_EQ(look_up(t, p, {}, 3), (std::vector<float>{0, 0.25f, 0.5f}));
  EXPECT_FALSE(system.add(make_image(4, 4, 1, [](int x, int, int) { return x; }), TextureUse::scalar, "x").constant());
}

TEST(TextureSystem, ConstantImagesStillEndWhereTheyAreBlackOutside) {
  TextureSystem system;
  const TextureHandle t =
      system.add(make_image(16, 16, 1, [](int, int, int) { return 1.0f; }), TextureUse::scalar, "white");
  EXPECT_EQ(look_up(t, 0.5f, 0.5f, 0, {Wrap::black}), 1);
  EXPECT_EQ(look_up(t, 1.5f, 0.5f, 0, {Wrap::black}), 0);
}

TEST(TextureSystem, ScalarsKeepTheirPrecision) {
  const test::TemporaryFolder folder;
  OutputImage ramp = to_output(make_image(4, 4, 1, [](int x, int, int) { return 100 + x * 0.001f; }));
  ExrOptions options;
  options.type = SampleType::full_float;
  write_exr(folder.file("height.exr"), ramp, options);
  TextureSystem system;
  const TextureHandle t = system.open(folder.file("height.exr"), Encoding::automatic(), TextureUse::scalar, {});
  EXPECT_FLOAT_EQ(look_up(t, 0.375f, 0.5f), 100.001f);
}

TEST(TextureSystem, OneHandleAFileAndFailuresAreInputErrors) {
  const test::TemporaryFolder folder;
  write_png(folder.file("a.png"), to_output(make_image(large, large, 1, [](int x, int, int) { return x % 2; })));
  test::write_bytes(folder.file("b.png"), "not a picture");
  TextureSystem system;
  const TextureHandle first = system.open(folder.file("a.png"), Encoding::automatic(), TextureUse::color, {});
  const TextureHandle again = system.open(folder.file("./a.png"), Encoding::automatic(), TextureUse::color, {});
  EXPECT_EQ(system.statistics().files, 1);
  const TextureHandle other = system.open(folder.file("a.png"), Encoding::linear(), TextureUse::color, {});
  EXPECT_EQ(system.statistics().files, 2);
  EXPECT_THROW(system.open(folder.file("b.png"), Encoding::automatic(), TextureUse::color, {}), InputError);
  EXPECT_THROW(system.open(folder.file("c.png"), Encoding::automatic(), TextureUse::color, {}), InputError);
}

TEST(TextureSystem, HandlesOutliveTheSystemAndNothingStaysBehind) {
  const test::TemporaryFolder folder;
  {
    TextureHandle handle;
    {
      TextureSystem system(1 << 20, folder.path().string());
      handle = system.add(make_image(large, large, 1, [](int x, int y, int) { return (x + y) % 2; }),
                          TextureUse::scalar, "checker");
      EXPECT_EQ(folder.names().size(), 1u);
    }
    EXPECT_NEAR(look_up(handle, 0.5f, 0.5f, 0.1f), 0.5f, 1e-3f);
    EXPECT_EQ(folder.names().size(), 1u);
  }
  EXPECT_TRUE(folder.names().empty());
}

TEST(TextureSystem, FoldersOfKilledRunsAreSwept) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("dapple-textures-dead"));
  test::write_bytes(folder.file("dapple-textures-dead/lock"), "");
  test::write_bytes(folder.file("dapple-textures-dead/0.exr"), "x");
  std::filesystem::create_directory(folder.file("unrelated"));
  test::write_bytes(folder.file("unrelated/lock"), "");
  const image::TemporaryFolder mine(folder.path().string());
  EXPECT_FALSE(std::filesystem::exists(folder.file("dapple-textures-dead")));
  EXPECT_TRUE(std::filesystem::exists(folder.file("unrelated/lock")));
  const image::TemporaryFolder second(folder.path().string());
  EXPECT_TRUE(std::filesystem::exists(mine.path()));  // in use: not swept
  EXPECT_THROW(image::TemporaryFolder(folder.file("absent")), IoError);
}

/// The value of a look-up must depend on nothing but its arguments: not on threads, nor on the size of the cache.
TEST(TextureSystem, DeterministicForAnyThreadsAndCache) {
  const Image noise = make_image(2048, 1024, 3, [](int x, int y, int c) { return to_unit_float(hash(x, y, c)); });
  Points points;
  KeyedRng rng(9);
  for (int i = 0; i < 4000; ++i) points.add(4 * rng.next() - 2, 4 * rng.next() - 2, std::exp2(-12 * rng.next()));
  for (const TextureFilter filter : all_filters) {
    std::vector<float> first;
    for (const uint64_t bytes : {uint64_t{4} << 20, uint64_t{1} << 28})
      for (const int threads : {1, 7}) {
        TextureSystem system(bytes);
        const TextureHandle texture = system.add(noise, TextureUse::color, "noise");
        std::vector<float> out(points.s.size() * 3);
        std::vector<std::thread> workers;
        for (int w = 0; w < threads; ++w)
          workers.emplace_back([&, w] {
            const int n = static_cast<int>(points.s.size()), begin = n * w / threads, end = n * (w + 1) / threads;
            TextureCoordinates c = points.view();
            c.count = end - begin;
            for (const float** p : {&c.s, &c.t, &c.dsdx, &c.dtdx, &c.dsdy, &c.dtdy}) *p += begin;
            texture.lookup(c, {Wrap::repeat, filter}, 3, out.data() + 3 * begin);
          });
        for (std::thread& w : workers) w.join();
        if (first.empty()) first = out;
        EXPECT_TRUE(out == first) << threads << " threads, " << bytes << " bytes";
        if (bytes == uint64_t{4} << 20) {
          EXPECT_GT(system.statistics().evictions, 0u);
          EXPECT_LT(system.statistics().bytes, 16u << 20);
        }
        EXPECT_GT(system.statistics().fills, 0u);
      }
  }
}

TEST(TextureSystem, TiledPyramidsAreUsedInPlace) {
  const test::TemporaryFolder folder, temporary;
  write_mip_pyramid(folder.file("tiled.exr"),
                    make_image(large, large, 3, [](int x, int, int c) { return c * 0.25f + 0.125f * (x < large / 2); }),
                    SampleType::half_float);
  TextureSystem system(1 << 24, temporary.path().string());
  const TextureHandle t = system.open(folder.file("tiled.exr"), Encoding::automatic(), TextureUse::color, {});
  EXPECT_TRUE(temporary.names().empty());
  Points p;
  p.add(0.25f, 0.5f, 0.01f);
  EXPECT_EQ(look_up(t, p, {}, 3), (std::vector<float>{0.125f, 0.375f, 0.625f}));
}

TEST(MipPyramid, MeansAreKeptForAnySize) {
  for (const auto& [w, h] : {std::pair{64, 64}, {37, 22}, {1, 17}, {3, 3}, {255, 1}, {101, 99}}) {
    Image image = make_image(w, h, 2, [](int x, int y, int c) { return to_unit_float(hash(x, y, c)); });
    double mean[2] = {0, 0};
    for (size_t i = 0; i < image.pixels().size(); ++i) mean[i % 2] += image.pixels()[i] / (image.pixels().size() / 2);
    while (image.width() > 1 || image.height() > 1) {
      const Image next = half_size(image);
      ASSERT_EQ(next.width(), std::max(1, image.width() / 2));
      ASSERT_EQ(next.height(), std::max(1, image.height() / 2));
      image = next;
    }
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(image.pixels()[c], mean[c], 1e-5) << w << "x" << h;
  }
}

}  // namespace
}  // namespace dapple::image
