// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/denoise_apart.h"
#include "dapple/denoise/transfer.h"

using namespace dapple;
using image::Image;

namespace {

const std::string folder = std::string(DAPPLE_SOURCE_DIR) + "/data/denoise/";
const std::string data = std::string(DAPPLE_SOURCE_DIR) + "/tests/denoise/data/";

Image layer(const Image& all, std::vector<std::string> names) {
  std::vector<int> channels;
  for (const auto& name : names) channels.push_back(all.channel(name));
  return all.select(channels);
}

struct Picture {
  Image colour, albedo, normal;
};

Picture picture() {
  const Image all = image::read_image(data + "noisy.exr", {});
  return {layer(all, {"R", "G", "B"}), layer(all, {"albedo.R", "albedo.G", "albedo.B"}),
          layer(all, {"normal.X", "normal.Y", "normal.Z"})};
}

Image plain(int w, int h, float value) {
  Image result(w, h, 3);
  std::fill(result.pixels().begin(), result.pixels().end(), value);
  return result;
}

bool same(const Image& a, const Image& b) {
  return std::ranges::equal(a.pixels(), b.pixels());
}

std::vector<std::byte> bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

}  // namespace

// The expected image is that of an independent implementation in numpy (data/make.py). It and oneDNN add in different
// orders: 1e-3 of the transferred value is the bound that the network is held to.
TEST(Denoiser, EqualsAnIndependentImplementation) {
  const Picture p = picture();
  const Image expected = image::read_image(data + "expected.exr", {});
  const Image out = denoise::Denoiser(folder + "rt_hdr_alb_nrm.tza")(p.colour, &p.albedo, &p.normal);
  const float s = denoise::auto_exposure(denoise::ImageRows(p.colour));
  float worst = 0;
  for (size_t i = 0; i < out.pixels().size(); ++i)
    worst = std::max(
        worst, std::abs(denoise::to_display(out.pixels()[i] * s) - denoise::to_display(expected.pixels()[i] * s)));
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, 1e-3f);
}

TEST(Denoiser, IsTheSameForAnyThreads) {
  const Picture p = picture();
  const denoise::Denoiser denoiser(folder + "rt_hdr_alb_nrm.tza");
  set_thread_count(1);
  const Image one = denoiser(p.colour, &p.albedo, &p.normal);
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_TRUE(same(one, denoiser(p.colour, &p.albedo, &p.normal))) << threads;
  }
  set_thread_count(0);
}

TEST(Denoiser, PartsAddUp) {
  const denoise::Denoiser denoiser(folder + "rt_hdr_alb_nrm.tza");
  const Picture p = picture();
  const denoise::ImageRows colour(p.colour), albedo(p.albedo), normal(p.normal);
  const auto apart = [&](const Image& part) {
    return denoise::denoise_apart(denoiser, colour, denoise::ImageRows(part), &albedo, &normal, {});
  };
  const Image whole = denoiser(p.colour, &p.albedo, &p.normal);
  EXPECT_TRUE(same(apart(plain(p.colour.width(), p.colour.height(), 0)), whole));  // no such part
  EXPECT_TRUE(same(apart(p.colour), whole));                                       // nothing else
  Image half = p.colour;
  for (float& v : half.pixels()) v *= .5f;
  denoise::Denoiser::Options exposed;
  exposed.exposure = denoise::auto_exposure(colour);
  const Image of_half = denoiser(half, &p.albedo, &p.normal, exposed), both = apart(half);
  for (size_t i = 0; i < both.pixels().size(); ++i) ASSERT_EQ(both.pixels()[i], 2 * of_half.pixels()[i]) << i;
  EXPECT_THROW(apart(plain(p.colour.width(), p.colour.height() + 1, 0)), UsageError);
}

// The overlap covers all that the network sees; only the order of sums may differ with the place in a band.
TEST(Denoiser, TilesShowNoSeams) {
  Image colour(300, 40, 3);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 300; ++x)
      for (int c = 0; c < 3; ++c)
        colour.pixel(x, y)[c] = .1f + static_cast<float>((x * 7919 + y * 104729 + c * 31) % 101) / 101;
  const denoise::Denoiser denoiser(folder + "rt_hdr.tza");
  const Image whole = denoiser(colour, nullptr, nullptr), tiles = denoiser(colour, nullptr, nullptr, {.tile = 64});
  for (size_t i = 0; i < whole.pixels().size(); ++i)
    ASSERT_NEAR(whole.pixels()[i], tiles.pixels()[i], 1e-4f * whole.pixels()[i] + 1e-6f);
}

TEST(Denoiser, StaysSaneOnOddPictures) {
  const denoise::Denoiser denoiser(folder + "rt_hdr.tza");
  for (const auto& [w, h] : {std::pair(1, 1), std::pair(17, 3), std::pair(64, 64)}) {
    for (const float value : {0.f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      const Image out = denoiser(plain(w, h, value), nullptr, nullptr);
      for (const float v : out.pixels()) EXPECT_EQ(v, 0);
    }
  }
  const Image grey = denoiser(plain(64, 64, .5f), nullptr, nullptr);
  EXPECT_NEAR(grey.pixel(32, 32)[1], .5f, .05f);  // a network is no exact filter: 10 %
}

TEST(Tensors, TruncatedFilesAreBadInput) {
  const auto bytes = bytes_of(folder + "rt_hdr.tza");
  ASSERT_GT(bytes.size(), 1000000u);
  for (size_t n = 0; n < bytes.size(); n += 1 + bytes.size() / 60)
    EXPECT_THROW(denoise::parse_tensors(std::span(bytes).first(n), "cut.tza"), InputError) << n;
}

TEST(Tensors, HostileTablesAreBadInput) {
  const auto bytes = bytes_of(folder + "rt_hdr.tza");
  uint64_t table;
  std::memcpy(&table, bytes.data() + 4, 8);
  for (size_t i = table; i < bytes.size(); ++i) {
    auto broken = bytes;
    broken[i] = std::byte{0xff};
    try {
      const denoise::UNet net(denoise::parse_tensors(broken, "broken.tza"), "broken.tza");
    } catch (const InputError&) {
    }
  }
  EXPECT_THROW(denoise::UNet({}, "empty.tza"), InputError);
}

TEST(Transfer, IsInvertible) {
  for (float y = 1e-7f; y < 60000; y *= 1.3f) EXPECT_NEAR(denoise::from_display(denoise::to_display(y)), y, 1e-3f * y);
}
