// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile::test {

/// An empty folder that goes away with the object.
class TempFolder {
 public:
  TempFolder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string("dapple_") + info->test_suite_name() + "_" + info->name() + "_" + std::to_string(getpid()));
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string write(const std::string& name, std::string_view contents) const {
    const std::string path = (path_ / name).string();
    std::ofstream(path, std::ios::binary) << contents;
    return path;
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

inline SceneDescription parse(const std::string& text, Diagnostics* diagnostics = nullptr) {
  set_log_level(0);
  Diagnostics own;
  return parse_pbrt(text, "test.pbrt", "", diagnostics ? *diagnostics : own);
}

/// The scene of `text` after WorldBegin on its line 1.
inline SceneDescription parse_world(const std::string& text) {
  return parse("WorldBegin " + text);
}

/// The message of the InputError that f throws; empty if it does not.
template <class F>
std::string error_of(F f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

inline std::string parse_error(const std::string& text) {
  return error_of([&] { parse(text); });
}

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

#define EXPECT_CONTAINS(text, part) \
  EXPECT_TRUE(::dapple::scenefile::test::contains(text, part)) << "no \"" << (part) << "\" in: " << (text)

}  // namespace dapple::scenefile::test
