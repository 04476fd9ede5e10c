// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/nvdb_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>

#include "dapple/base/hash.h"
#include "tests/support/nvdb_writer.h"

namespace dapple::media {
namespace {

using test::nvdb_file;
using test::NvdbWriter;

SparseGrid read(const std::string& file, NvdbValues values = NvdbValues::any) {
  return NvdbFile(file, false).read("density", values);
}

std::string error_of(const std::function<void()>& what) {
  try {
    what();
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}
std::string error_of(const std::string& file) {
  return error_of([&] { read(file); });
}

template <class T>
std::string with(std::string bytes, size_t place, T v) {
  bytes.replace(place, sizeof v, reinterpret_cast<const char*>(&v), sizeof v);
  return bytes;
}

/// Voxels over the borders of all kinds of nodes, and tiles of all sizes.
NvdbWriter mixed() {
  NvdbWriter w;
  w.background = 0.25f;
  for (int i = -9; i <= 9; ++i) w.set({i, 2 * i, -i}, float(i));
  w.set({4095, 4096, -4097}, 7);
  w.set({127, 128, 129}, 8, false);
  w.tile({-300, 40, 40}, 3, 2);
  w.tile({1000, 1000, 1000}, 7, 3, false);
  w.tile({9000, 0, 0}, 12, 4);
  return w;
}

TEST(NvdbFile, ValuesOfVoxelsTilesAndBackground) {
  for (const uint16_t codec : {0, 1, 2}) {
    const SparseGrid g = read(nvdb_file({mixed()}, codec));
    for (int i = -9; i <= 9; ++i) EXPECT_EQ(g.at(i, 2 * i, -i), float(i));
    EXPECT_EQ(g.at(4095, 4096, -4097), 7);
    EXPECT_EQ(g.at(127, 128, 129), 8);
    EXPECT_EQ(g.at(127, 128, 130), 0.25f);
    EXPECT_EQ(g.at(-304, 40, 47), 2);
    EXPECT_EQ(g.at(-305, 40, 47), 0.25f);
    EXPECT_EQ(g.at(1023, 896, 900), 3);
    EXPECT_EQ(g.at(1024, 896, 900), 0.25f);
    EXPECT_EQ(g.at(8192, 4095, 0), 4);
    EXPECT_EQ(g.at(8192, 4096, 0), 0.25f);
    EXPECT_EQ(g.at(-2000000, 5, 5), 0.25f);
    EXPECT_EQ(g.max(), 9);
    EXPECT_EQ(g.negatives(), 0u);
    // Active: the diagonal, the far voxel, the small tile and the large one.
    EXPECT_EQ(g.active().lo, V3i(-304, -18, -4097));
    EXPECT_EQ(g.active().hi, V3i(12288, 4097, 4096));
  }
  EXPECT_EQ(read(nvdb_file({mixed()}), NvdbValues::from_zero).negatives(), 9u);
  EXPECT_EQ(read(nvdb_file({mixed()}), NvdbValues::from_zero).at(-3, -6, 3), 0);
}

TEST(NvdbFile, TrilinearBetweenVoxels) {
  NvdbWriter w;
  const auto f = [](int x, int y, int z) { return float(hash(1, x, y, z) % 1000) / 1000; };
  for (int x = -10; x < 10; ++x)
    for (int y = -10; y < 10; ++y)
      for (int z = -10; z < 10; ++z) w.set({x, y, z}, f(x, y, z));
  const SparseGrid g = read(nvdb_file({w}));
  KeyedRng rng(3);
  for (int i = 0; i < 2000; ++i) {
    const V3f p(rng.next() * 18 - 9, rng.next() * 18 - 9, rng.next() * 18 - 9);
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      double weight = 1;
      int at[3];
      for (int k = 0; k < 3; ++k) {
        const double low = std::floor(double(p[k])), t = double(p[k]) - low;
        at[k] = int(low) + ((c >> k) & 1);
        weight *= (c >> k) & 1 ? t : 1 - t;
      }
      sum += weight * double(f(at[0], at[1], at[2]));
    }
    ASSERT_NEAR(g.lookup(p), sum, 1e-5) << p;
  }
  EXPECT_EQ(g.lookup(V3f(infinity, 0, 0)), 0);
  EXPECT_EQ(g.lookup(V3f(std::numeric_limits<float>::quiet_NaN(), 0, 0)), 0);
  EXPECT_EQ(g.lookup(V3f(0, -3e9f, 0)), 0);
}

TEST(NvdbFile, VisitsAllThatIsNotBackground) {
  const SparseGrid g = read(nvdb_file({mixed()}));
  int blocks = 0;
  double tiles = 0;
  g.visit(
      [&](const V3i& at, const float* values) {
        ++blocks;
        for (int i = 0; i < 512; ++i)
          ASSERT_EQ(values[i], g.at(at.x + (i >> 6), at.y + ((i >> 3) & 7), at.z + (i & 7)));
      },
      [&](const V3i& at, int edge, float v) {
        tiles += v * std::pow(edge, 3);
        ASSERT_EQ(v, g.at(at.x + edge - 1, at.y, at.z + edge - 1));
      });
  EXPECT_GT(blocks, 5);
  EXPECT_EQ(tiles, 2 * std::pow(8, 3) + 3 * std::pow(128, 3) + 4 * std::pow(4096, 3));
}

TEST(NvdbFile, SeveralGridsAndSegments) {
  NvdbWriter a = mixed(), b;
  b.name = "heat", b.set({1, 2, 3}, 5);
  const std::string bytes = nvdb_file({a, b}, 1) + nvdb_file({b}, 2);
  const NvdbFile file(bytes, false);
  EXPECT_EQ(file.names(), (std::vector<std::string>{"density", "heat", "heat"}));
  EXPECT_EQ(file.read("heat", NvdbValues::any).at(1, 2, 3), 5);
  EXPECT_NE(error_of([&] { file.read("smoke", NvdbValues::any); }), "");
}

// A tile of its own is one value: no copy is larger than the grid.
TEST(NvdbFile, CopiesAreNoLargerThanTheGrid) {
  NvdbWriter w;
  for (int i = 0; i < 60000; ++i)
    w.set({int(hash(1, i) % 300), int(hash(2, i) % 300), int(hash(3, i) % 300)}, float(i));
  EXPECT_LE(read(nvdb_file({w})).bytes(), w.grid().size());
}

TEST(NvdbFile, ForeignFilesAreErrors) {
  EXPECT_NE(error_of(std::string()), "");
  EXPECT_NE(error_of(std::string(1000, 'x')).find("no NanoVDB file"), std::string::npos);
  EXPECT_NE(error_of("NanoVDB1" + std::string(800, 0)).find("bare grid"), std::string::npos);
  const std::string good = nvdb_file({mixed()});
  EXPECT_NE(error_of(with(good, 8, uint32_t(29u << 21))).find("version 29"), std::string::npos);
  EXPECT_NE(error_of(with(good, 14, uint16_t(3))).find("codec"), std::string::npos);
  NvdbWriter other = mixed();
  other.type = 15;
  EXPECT_NE(error_of(nvdb_file({other})).find("Fp16; expected float"), std::string::npos);
  other = mixed(), other.grid_class = 1;
  EXPECT_NE(error_of(nvdb_file({other})).find("level set"), std::string::npos);
  other = mixed(), other.matrix[0] = 0;
  EXPECT_NE(error_of(nvdb_file({other})).find("inverted"), std::string::npos);
  other = mixed(), other.set({0, 0, 0}, infinity);
  EXPECT_NE(error_of(nvdb_file({other})).find("not finite"), std::string::npos);
}

TEST(NvdbFile, EveryTruncationIsAnError) {
  NvdbWriter w;
  w.set({0, 0, 0}, 1);
  for (const uint16_t codec : {0, 1, 2}) {
    const std::string good = nvdb_file({w}, codec);
    ASSERT_EQ(error_of(good), "");
    for (size_t n = 0; n < good.size(); n += n < 1200 ? 1 : good.size() / 97)
      ASSERT_NE(error_of(good.substr(0, n)), "") << codec << " " << n;
  }
  // The file's own sizes lowered with it.
  const std::string good = nvdb_file({w});
  const size_t size = w.grid().size();
  for (size_t n = 700; n < size; n += 5003) {
    const std::string part = good.substr(0, good.size() - size + n);
    ASSERT_NE(error_of(with(with(part, 16, uint64_t(n)), 24, uint64_t(n))), "") << n;
  }
}

TEST(NvdbFile, HostileOffsetsAndCountsAreErrors) {
  NvdbWriter w;
  w.set({0, 0, 0}, 1), w.set({8, 0, 0}, 2), w.set({200, 0, 0}, 3), w.set({5000, 0, 0}, 4);
  const std::string good = nvdb_file({w});
  ASSERT_EQ(error_of(good), "");
  const size_t grid = good.size() - w.grid().size(), root = grid + 736, upper = root + 64 + 2 * 32;
  // Claims of a few bytes do not take memory.
  EXPECT_NE(error_of(with(good, root + 24, uint32_t(0xffffffff))).find("root"), std::string::npos);
  EXPECT_NE(error_of(with(good, 136 + 16, uint32_t(0x7fffffff))).find("name"), std::string::npos);
  const std::string zip = nvdb_file({w}, 1);
  EXPECT_NE(error_of(with(zip, 16, uint64_t(1) << 40)).find("implausible"), std::string::npos);
  EXPECT_NE(error_of(with(zip, 16, w.grid().size() + 32)), "");
  EXPECT_NE(error_of(with(nvdb_file({w}, 2), 16, w.grid().size() + 32)), "");
  // Two parents of one node, two entries of one place.
  const auto entry_of = [&](size_t i) { return root + 64 + 32 * i; };
  int64_t child = 0;
  std::memcpy(&child, good.data() + entry_of(0) + 8, sizeof child);
  EXPECT_NE(error_of(with(good, entry_of(1) + 8, child)).find("overlap"), std::string::npos);
  EXPECT_NE(error_of(with(good, entry_of(1) + 8, child + 32)).find("overlap"), std::string::npos);
  uint64_t key = 0;
  std::memcpy(&key, good.data() + entry_of(0), sizeof key);
  EXPECT_NE(error_of(with(good, entry_of(1), key)).find("two root entries"), std::string::npos);
  EXPECT_NE(error_of(with(good, entry_of(1), uint64_t(1) << 41)).find("beyond"), std::string::npos);
  EXPECT_NE(error_of(with(good, entry_of(1), uint64_t(1) << 61)).find("2^30"), std::string::npos);
  // All entries of a node are children: pointing at nothing, at the end, far away.
  std::string all = good;
  for (size_t i = 0; i < 4096; ++i) all[upper + 4128 + i] = char(255);
  EXPECT_NE(error_of(all), "");
  for (const int64_t distance :
       {int64_t(-1) << 62, std::numeric_limits<int64_t>::max(), int64_t(-100000), int64_t(w.grid().size()) - 1000})
    EXPECT_NE(error_of(with(good, upper + 8256, distance)), "") << distance;
}

TEST(NvdbFile, DamagedBytesNeverCrash) {
  const std::string good = nvdb_file({mixed()}), zip = nvdb_file({mixed()}, 1), blosc = nvdb_file({mixed()}, 2);
  int errors = 0;
  for (int i = 0; i < 600; ++i) {
    std::string bad = i % 3 == 0 ? good : i % 3 == 1 ? zip : blosc;
    // Half of them where the headers are.
    const size_t range = i % 2 ? std::min<size_t>(bad.size(), 1400) : bad.size();
    for (int k = 0; k < 4; ++k) bad[hash(5, i, k) % range] = char(hash(6, i, k));
    errors += !error_of(bad).empty();
  }
  EXPECT_GT(errors, 100);
}

}  // namespace
}  // namespace dapple::media
