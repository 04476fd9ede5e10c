// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/child_process.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <memory>

#include "tests/scenefile/support.h"

namespace dapple::modelfile {
namespace {

std::string failure_of(const std::function<std::string()>& work, const ChildLimits& limits = {}) {
  try {
    run_in_child(work, limits);
  } catch (const ChildFailure& f) {
    return f.what();
  }
  return "";
}

TEST(ChildProcess, ReturnsWhatWorkReturns) {
  std::string large(5'000'000, 'x');
  large[4'999'999] = '\0';
  EXPECT_EQ(run_in_child([&] { return large; }, {}), large);
  EXPECT_EQ(run_in_child([] { return std::string(); }, {}), "");
}

TEST(ChildProcess, PassesExceptionsOn) {
  try {
    run_in_child([]() -> std::string { throw std::runtime_error("what is wrong"); }, {});
    FAIL();
  } catch (const ChildFailure&) {
    FAIL() << "an exception is no failure of the process";
  } catch (const std::runtime_error& e) {
    EXPECT_STREQ(e.what(), "what is wrong");
  }
}

TEST(ChildProcess, SurvivesCrashes) {
  EXPECT_NE(failure_of([]() -> std::string { std::abort(); }).find("crashed"), std::string::npos);
  EXPECT_NE(failure_of([]() -> std::string { _exit(5); }), "");
  EXPECT_NE(failure_of([]() -> std::string { _exit(0); }), "") << "an end without a result is none";
}

TEST(ChildProcess, EndsWhatTakesTooLong) {
  ChildLimits limits;
  limits.seconds = 1;
  volatile bool forever = true;
  const std::string computes = failure_of(
      [&]() -> std::string {
        while (forever) {
        }
        return "";
      },
      limits);
  EXPECT_NE(computes.find("more than 1 s"), std::string::npos) << computes;
  const std::string sleeps = failure_of(
      [&]() -> std::string {
        while (forever) usleep(100000);
        return "";
      },
      limits);
  EXPECT_NE(sleeps.find("more than 1 s"), std::string::npos) << sleeps;
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(ChildProcess, BoundsMemory) {
  ChildLimits limits;
  limits.memory_bytes = uint64_t(100) << 20;
  const std::string why = failure_of(
      []() -> std::string {
        std::string hoard;
        for (;;) hoard.append(size_t(1) << 24, 'x');
      },
      limits);
  EXPECT_NE(why.find("of memory"), std::string::npos) << why;
}
#endif

TEST(ChildProcess, BoundsResults) {
  ChildLimits limits;
  limits.result_bytes = 1'000'000;
  EXPECT_NE(failure_of([] { return std::string(3'000'000, 'x'); }, limits).find("MB of data"), std::string::npos);
}

TEST(ChildProcess, WritesNoFile) {
  const scenefile::test::TempFolder folder;
  const std::string path = folder.path() + "/file";
  failure_of([&]() -> std::string {
    std::ofstream(path) << "text";
    return "done";
  });
  std::ifstream in(path);
  EXPECT_EQ(in.get(), EOF);
}

}  // namespace
}  // namespace dapple::modelfile
