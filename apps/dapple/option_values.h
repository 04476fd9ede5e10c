// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/angle.h"
#include "dapple/base/number_text.h"
#include "dapple/base/vec.h"

namespace dapple::app {

/// Finite numbers between marks, such as "12,-3.5" or "2024-06-21"; empty where the text is anything else.
std::vector<double> numbers(std::string_view text, char mark, size_t count);

// What follows throws UsageError, with the option, what it was given and what is legal.

/// `count` numbers between commas.
std::vector<double> numbers_of(const std::string& option, const std::string& text, size_t count,
                               const std::string& expected);
void check_range(const std::string& option, double value, double low, double high, const std::string& units);
/// "X0,X1,Y0,Y1", metres.
Imath::Box2d rectangle(const std::string& option, const std::string& text);
/// "1024x576", both at least 1.
V2i resolution(const std::string& option, const std::string& text);
/// "X0,Y0,X1,Y1", pixels.
Box2i crop(const std::string& option, const std::string& text);

/// What --lod says (build/level_of_detail.h); none where it is not given. level_of_detail_check() goes before.
std::optional<float> level_of_detail_option(const std::string& text);
CLI::Validator level_of_detail_check();

/// Checks of options' numbers: above 0, and 0 or more.
CLI::Validator positive();
CLI::Validator non_negative();
/// Whole and from 0 to 2^64 - 1: the parser itself takes -1 for the last of these, and the last for all beyond.
CLI::Validator seed_check();

/// The option --threads of all commands.
void add_threads(CLI::App& app, int& threads);

}  // namespace dapple::app
