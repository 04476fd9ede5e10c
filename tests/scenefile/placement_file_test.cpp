// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/placement_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "dapple/base/hash.h"

namespace dapple::scenefile {
namespace {

std::vector<ExactPlacement> scattered(size_t count) {
  std::vector<ExactPlacement> out(count);
  KeyedRng rng(1);
  for (ExactPlacement& m : out) {
    for (double& x : m) x = double(rng.next());
    m[3] = 4e6 + 1000 * double(rng.next()), m[7] = -2e6 + 1000 * double(rng.next());
  }
  return out;
}

std::string message_of(std::string_view bytes) {
  try {
    PlacementFile(bytes, "bad.places", {});
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

// Far from the world's origin places keep to a tenth of a millimetre, since chunks have origins in double: floats have
// steps of a quarter of a metre there.
TEST(PlacementFiles, GiveBackWhatWasWritten) {
  const auto placements = scattered(10000);
  const std::string bytes = encode_placements(placements);
  const PlacementFile file(bytes, "test.places", {});
  ASSERT_EQ(file.size(), placements.size());
  EXPECT_EQ(file.chunks().size(), 3u);
  size_t next = 0;
  file.for_each_block([&](const auto& chunk, uint64_t, std::span<const PlacementRows> rows) {
    for (const PlacementRows& m : rows) {
      for (size_t k = 0; k < 12; ++k) {
        const double base = k % 4 == 3 ? chunk.origin[int(k / 4)] : 0;
        ASSERT_NEAR(base + double(m[k]), placements[next][k], k % 4 == 3 ? 1e-4 : 1e-7);
      }
      ++next;
    }
  });
  EXPECT_EQ(next, placements.size());
  const auto sample = file.sample();
  EXPECT_GT(sample.size(), 4000u);
  for (const ExactPlacement& m : sample) EXPECT_NEAR(m[3], 4e6, 1001);
  EXPECT_EQ(PlacementFile(encode_placements({}), "", {}).size(), 0u);
}

// What leaves the range that chunks may lie in does not count where a scene is, however large its floats.
TEST(PlacementFiles, SampleNothingBeyondTheirRange) {
  std::string bytes = encode_placements(scattered(3));
  const float far = 3e30f;
  std::memcpy(bytes.data() + 40 + 32 + 48 + 12, &far, 4);  // x of the second
  const auto sample = PlacementFile(bytes, "far.places", {}).sample();
  ASSERT_EQ(sample.size(), 2u);
  for (const ExactPlacement& m : sample) EXPECT_LT(std::abs(m[3]), 1e12);
}

// Rationale: a forest is written anew while a render reads it. Expectation: an error that says so, no fault.
TEST(PlacementFiles, MayBeCutWhileTheyAreRead) {
  const auto path = std::filesystem::temp_directory_path() / ("dapple_cut_" + std::to_string(getpid()) + ".places");
  const std::string bytes = encode_placements(scattered(20000));
  std::ofstream(path, std::ios::binary) << bytes;
  const PlacementFile file(path.string(), {});
  std::filesystem::resize_file(path, bytes.size() / 2);
  size_t seen = 0;
  try {
    file.for_each_block([&](const auto&, uint64_t, std::span<const PlacementRows> rows) { seen += rows.size(); });
    ADD_FAILURE();
  } catch (const InputError& problem) {
    EXPECT_NE(std::string(problem.what()).find("shorter while it was read"), std::string::npos) << problem.what();
  }
  EXPECT_GT(seen, 4000u);
  EXPECT_LT(seen, 10000u);
  EXPECT_THROW(file.sample(), InputError);
  std::filesystem::remove(path);
}

// Whatever is cut off or changed in the head is found, and where.
TEST(PlacementFiles, RefuseDamage) {
  const std::string good = encode_placements(scattered(5000));
  EXPECT_EQ(message_of(good), "");
  for (const size_t size : {size_t(0), size_t(10), size_t(16), size_t(30), size_t(40), size_t(60), good.size() - 1}) {
    const std::string message = message_of(std::string_view(good).substr(0, size));
    EXPECT_EQ(message.find("bad.places: byte "), 0u) << size << ": " << message;
  }
  EXPECT_NE(message_of(good + "x").find("more bytes"), std::string::npos);
  const auto with = [&good](size_t at, uint64_t value, size_t bytes) {
    std::string bad = good;
    std::memcpy(bad.data() + at, &value, bytes);
    return message_of(bad);
  };
  EXPECT_NE(with(0, 7, 4).find("no placements"), std::string::npos);
  EXPECT_NE(with(16, 2, 4).find("version 2"), std::string::npos);
  EXPECT_NE(with(20, 1, 4).find("zero"), std::string::npos);
  EXPECT_NE(with(24, ~0ull, 8).find("fewer placements"), std::string::npos);
  EXPECT_NE(with(24, 4999, 8).find("chunks hold 5000"), std::string::npos);
  EXPECT_NE(with(32, ~0ull, 8).find("fewer chunks"), std::string::npos);
  EXPECT_NE(with(40, 0x7ff0000000000000ull, 8).find("origin"), std::string::npos);
  EXPECT_NE(with(64, ~0ull / 48, 8).find("fewer placements in a chunk"), std::string::npos);
}

TEST(PlacementTexts, AreReadByTheLine) {
  const auto p = parse_placement_text("# trees\n1 2 3\n\n4 5 6 90 # turned\n7 8 9 180 2\n1 0 0 4 0 2 0 5 0 0 3 6", "t");
  ASSERT_EQ(p.size(), 4u);
  EXPECT_EQ(p[0], (ExactPlacement{1, -0.0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}));
  EXPECT_NEAR(p[1][1], -1, 1e-12);
  EXPECT_NEAR(p[1][4], 1, 1e-12);
  EXPECT_NEAR(p[2][0], -2, 1e-12);
  EXPECT_EQ(p[2][10], 2);
  EXPECT_EQ(p[3], (ExactPlacement{1, 0, 0, 4, 0, 2, 0, 5, 0, 0, 3, 6}));
  for (const char* bad :
       {"1 2", "1 2 3 4 5 6", "1 2 x", "1 2 nan", "1 2 1e13", "1 2 3 4 0", "1 1 1 1 1 1 1 1 1 1 1 1 1"})
    try {
      parse_placement_text(std::string("0 0 0\n") + bad, "t");
      ADD_FAILURE() << bad;
    } catch (const InputError& problem) {
      EXPECT_EQ(std::string(problem.what()).find("t:2: "), 0u) << problem.what();
    }
}

}  // namespace
}  // namespace dapple::scenefile
