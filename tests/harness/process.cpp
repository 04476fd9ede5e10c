// SPDX-License-Identifier: Apache-2.0
#include "tests/support/process.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

namespace dapple::test {
namespace {

TEST(Process, ReportsCodeOutputAndFolder) {
  ScratchFolder folder;
  std::ofstream(folder.file("here")) << "x";
  const auto result = run_process({"/bin/sh", "-c", "ls; echo wrong >&2; exit 3"}, 10, folder.path().string());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.output, "here\nwrong\n");
  EXPECT_FALSE(result.timed_out);
}

TEST(Process, KillsWhatRunsTooLong) {
  const auto result = run_process({"/bin/sleep", "60"}, 0.2);
  EXPECT_TRUE(result.timed_out);
  EXPECT_EQ(result.signal, SIGKILL);
  EXPECT_EQ(result.exit_code, -1);
  EXPECT_LT(result.seconds, 10);
}

TEST(Process, DeliversSignals) {
  Process process({"/bin/sh", "-c", "trap 'exit 130' INT; echo ready; while :; do sleep 0.05; done"});
  while (process.output() != "ready\n") {
  }
  process.send(SIGINT);
  EXPECT_EQ(process.wait(10).exit_code, 130);
}

TEST(Process, MeasuresMemory) {
  // A child begins with the pages of this process: under sanitizers, many.
  const auto small = run_process({"/bin/true"}, 10);
  const auto large = run_process({"/bin/dd", "if=/dev/zero", "of=/dev/null", "bs=400M", "count=1"}, 20);
  EXPECT_EQ(large.exit_code, 0);
  EXPECT_LT(small.peak_rss_bytes, uint64_t{200} << 20);
  EXPECT_GT(large.peak_rss_bytes, uint64_t{400} << 20);
}

TEST(Process, MissingProgramGives127) {
  EXPECT_EQ(run_process({"/no/such/program"}, 10).exit_code, 127);
}

TEST(ScratchFolder, IsRemoved) {
  std::filesystem::path path;
  {
    ScratchFolder folder;
    path = folder.path();
    std::ofstream(folder.file("x")) << "x";
    EXPECT_TRUE(std::filesystem::exists(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace dapple::test
