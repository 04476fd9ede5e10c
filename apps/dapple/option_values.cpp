// SPDX-License-Identifier: Apache-2.0
#include "option_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/build/level_of_detail.h"

namespace dapple::app {

namespace {

/// Spaces may stand before a number.
template <class Number>
std::vector<Number> parse_list(std::string_view text, char mark, size_t count) {
  std::vector<Number> out;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    Number v = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
    if (error != std::errc() || !std::isfinite(double(v))) return {};
    out.push_back(v);
    text.remove_prefix(size_t(end - text.data()));
    if (text.empty()) break;
    if (text.front() != mark) return {};
    text.remove_prefix(1);
  }
  return out.size() == count ? out : std::vector<Number>();
}

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& expected) {
  throw UsageError(option + ": \"" + text + "\"; expected " + expected);
}

template <class Legal>
CLI::Validator number_check(const char* name, const std::string& expected, Legal legal) {
  const auto check = [=](const std::string& text) {
    double x = 0;
    const bool is_legal = CLI::detail::lexical_cast(text, x) && std::isfinite(x) && legal(x);
    return is_legal ? std::string() : "must be " + expected + ", not " + text;
  };
  return CLI::Validator(check, name);
}

}  // namespace

std::vector<double> numbers(std::string_view text, char mark, size_t count) {
  return parse_list<double>(text, mark, count);
}

std::vector<double> numbers_of(const std::string& option, const std::string& text, size_t count,
                               const std::string& expected) {
  const std::vector<double> v = numbers(text, ',', count);
  if (v.empty()) refuse(option, text, expected);
  return v;
}

void check_range(const std::string& option, double value, double low, double high, const std::string& units) {
  if (!(value >= low && value <= high))
    throw UsageError(option + " is " + shown(value) + ", expected a number from " + shown(low) + " to " + shown(high) +
                     units);
}

Imath::Box2d rectangle(const std::string& option, const std::string& text) {
  const auto v = numbers_of(option, text, 4, "X0,X1,Y0,Y1 in metres");
  for (const double x : v) check_range(option, x, -1e9, 1e9, " m");
  if (!(v[1] > v[0]) || !(v[3] > v[2])) refuse(option, text, "X0 below X1 and Y0 below Y1");
  return {Imath::V2d(v[0], v[2]), Imath::V2d(v[1], v[3])};
}

V2i resolution(const std::string& option, const std::string& text) {
  const std::vector<int> v = parse_list<int>(text, 'x', 2);
  if (v.empty() || v[0] < 1 || v[1] < 1) refuse(option, text, "WIDTHxHEIGHT, such as 960x540");
  return {v[0], v[1]};
}

Box2i crop(const std::string& option, const std::string& text) {
  const std::vector<int> v = parse_list<int>(text, ',', 4);
  if (v.empty()) refuse(option, text, "X0,Y0,X1,Y1 in pixels");
  return {V2i(v[0], v[1]), V2i(v[2], v[3])};
}

std::optional<float> level_of_detail_option(const std::string& text) {
  return text.empty() ? std::nullopt : build::level_of_detail(text);
}

CLI::Validator level_of_detail_check() {
  const auto check = [](const std::string& text) {
    return build::level_of_detail(text) ? std::string() : '"' + text + "\": " + build::expected_level_of_detail;
  };
  return {check, "LEVEL"};
}

CLI::Validator positive() {
  return number_check("POSITIVE", "above 0", [](double x) { return x > 0; });
}

CLI::Validator non_negative() {
  return number_check("NONNEGATIVE", "0 or more", [](double x) { return x >= 0; });
}

CLI::Validator seed_check() {
  const auto check = [](const std::string& text) {
    uint64_t seed = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
    // The parser takes what begins with 0 for octal.
    const bool is_octal = text.size() > 1 && text.front() == '0';
    const bool is_whole = error == std::errc() && end == text.data() + text.size() && !is_octal;
    return is_whole ? std::string() : "must be a whole number from 0 to 18446744073709551615, not " + text;
  };
  return CLI::Validator(check, "");
}

void add_threads(CLI::App& app, int& threads) {
  app.add_option("--threads", threads, "Threads; 0 = all processors")
      ->check(CLI::Range(0, most_threads))
      ->capture_default_str();
}

}  // namespace dapple::app
