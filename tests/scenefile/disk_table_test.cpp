// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/disk_table.h"

#include <gtest/gtest.h>

namespace dapple::scenefile {
namespace {

TEST(DiskTable, ReadsLines) {
  const DiskTable t = parse_disks("# leaves\n0.1 1 2 3 0 0 2\r\n\n+.5 -1e1 0 0 1 0 0 # the last", "t", {});
  ASSERT_EQ(t.radius.size(), 2u);
  EXPECT_EQ(t.radius[1], 0.5f);
  EXPECT_EQ(t.centre[0], V3f(1, 2, 3));
  EXPECT_EQ(t.centre[1].x, -10);
  EXPECT_EQ(t.normal[0], V3f(0, 0, 1));
}

// Rationale: damaged and hostile files. Expectation: an error with the line, the number and what is legal.
TEST(DiskTable, NamesWhatIsWrong) {
  const std::pair<const char*, const char*> cases[] = {
      {"1 2 3\n", "t:1: 3 numbers; expected 7"},    {"1 0 0 0 0 0 1 9", "t:1: more than 7"},
      {"\n0 0 0 0 0 0 1", "t:2: radius is 0"},      {"1 0 x 0 0 0 1", "y is \"x\", expected a number"},
      {"1 0 nan 0 0 0 1", "y is \"nan\""},          {"1 0 1e30 0 0 0 1", "y is \"1e30\""},
      {"1 0 0 0 0 0 0", "the normal's length is 0"}};
  for (const auto& [text, says] : cases) {
    try {
      parse_disks(text, "t", {});
      FAIL() << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
    }
  }
  EXPECT_LT(std::string([] {
              try {
                parse_disks(std::string(1 << 20, 'x'), "t", {});
              } catch (const InputError& e) {
                return std::string(e.what());
              }
              return std::string(10000, 'x');
            }())
                .size(),
            500u);
}

}  // namespace
}  // namespace dapple::scenefile
