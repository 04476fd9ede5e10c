// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/tokenizer.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <charconv>
#include <cmath>

#include "dapple/scenefile/text.h"
#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

using test::error_of;
using Kind = Token::Kind;

std::vector<Token> tokens_of(std::string_view text) {
  Tokenizer tokenizer(text, "t");
  std::vector<Token> tokens;
  for (Token t = tokenizer.next(); t.kind != Kind::end; t = tokenizer.next()) tokens.push_back(t);
  return tokens;
}

template <class T>
std::vector<T> numbers_of(std::string_view text) {
  std::vector<T> numbers;
  Tokenizer(text, "t").read_numbers(&numbers);
  return numbers;
}

TEST(Tokenizer, CutsWordsStringsAndBrackets) {
  const auto t = tokens_of("Shape \"a b\"[1 2]# no \" token\r\n\tEnd");
  ASSERT_EQ(t.size(), 7u);
  EXPECT_EQ(t[0].text, "Shape");
  EXPECT_EQ(t[1].kind, Kind::string);
  EXPECT_EQ(t[1].text, "a b");
  EXPECT_EQ(t[2].kind, Kind::open);
  EXPECT_EQ(t[4].text, "2");
  EXPECT_EQ(t[5].kind, Kind::close);
  EXPECT_EQ(t[6].text, "End");
  EXPECT_EQ(t[6].loc.line, 2u);
  EXPECT_EQ(t[6].loc.column, 2u);
}

TEST(Tokenizer, SkipsByteOrderMarkAndCountsColumnsAfterIt) {
  const auto t = tokens_of(
      "\xef\xbb\xbf"
      "Film\r\nCamera");
  ASSERT_EQ(t.size(), 2u);
  EXPECT_EQ(t[0].loc.column, 1u);
  EXPECT_EQ(t[1].loc.line, 2u);
}

TEST(Tokenizer, RefusesUtf16) {
  EXPECT_CONTAINS(error_of([] {
                    tokens_of(
                        std::string_view("\xff\xfe"
                                         "F\0",
                                         4));
                  }),
                  "UTF-16");
}

TEST(Tokenizer, StringsEndOnTheirLine) {
  EXPECT_EQ(error_of([] { tokens_of("a\n \"bc\nd\""); }).substr(0, 6), "t:2:2:");
  EXPECT_NE(error_of([] { tokens_of("\"abc\\\""); }), "");
  EXPECT_NE(error_of([] { tokens_of("\"abc\\"); }), "");
}

TEST(Tokenizer, ReplacesEscapes) {
  EXPECT_EQ(string_of(tokens_of(R"("a\"b\\c\td")")[0]), "a\"b\\c\td");
  EXPECT_NE(error_of([] { string_of(tokens_of(R"("a\q")")[0]); }), "");
}

TEST(Tokenizer, ReadsNumbersInTheirManyForms) {
  EXPECT_EQ(numbers_of<float>("1 +1 -1 .5 -.5 5. 1e3 1E-2 1e+2 -0"),
            (std::vector<float>{1, 1, -1, .5f, -.5f, 5, 1000, .01f, 100, 0}));
  EXPECT_EQ(numbers_of<int32_t>("2147483647 -2147483648 +7 # c\n 0"),
            (std::vector<int32_t>{2147483647, -2147483647 - 1, 7, 0}));
}

TEST(Tokenizer, TinyNumbersAreZeroOrDenormal) {
  const auto v = numbers_of<float>("1e-30 1e-60 -1e-400 1e-99999999999999");
  EXPECT_EQ(v, (std::vector<float>{1e-30f, 0, 0, 0}));
  EXPECT_EQ(numbers_of<float>("1e-40")[0], 1e-40f);
}

TEST(Tokenizer, RefusesWhatIsNoFiniteNumber) {
  for (const char* bad : {"nan", "inf", "-inf", "+-1", "--1", "-", "+", ".", "1e999999", "1e39", "-1e39", "1.2.3", "1,",
                          "1f", "0x10", "infinity", "NaN", "1e", "e5"})
    EXPECT_CONTAINS(error_of([&] { numbers_of<float>(bad); }), "t:1:1:") << bad;
  for (const char* bad : {"1.0", "99999999999999", "2147483648", "1e3", "x", "--2"})
    EXPECT_CONTAINS(error_of([&] { numbers_of<int32_t>(bad); }), "t:1:1:") << bad;
}

TEST(Tokenizer, MessagesDoNotPourOutTheFile) {
  const std::string secret(100000, 'x');
  EXPECT_LT(error_of([&] { numbers_of<float>(secret); }).size(), 200u);
}

TEST(Tokenizer, StopsAfterTheNumberAskedFor) {
  Tokenizer tokenizer("1 2 3 Shape", "t");
  std::vector<double> v;
  tokenizer.read_numbers(&v, 3);
  EXPECT_EQ(v.size(), 3u);
  EXPECT_EQ(tokenizer.next().text, "Shape");
}

TEST(Text, QuotesAreCleanedAndCut) {
  EXPECT_EQ(in_quotes("a\tb\x1b[31m\xff"), "\"a?b?[31m?\"");
  EXPECT_EQ(in_quotes("B\xc3\xa4ume"), "\"B\xc3\xa4ume\"");
  EXPECT_EQ(in_quotes("abcdef", 3), "\"abc...\"");
  EXPECT_EQ(in_quotes("ab\xc3\xa4"
                      "f",
                      3),
            "\"ab\xc3\xa4...\"");
}

TEST(Text, FindsCloseNames) {
  const std::vector<std::string_view> names = {"Shape", "Scale", "Camera"};
  ASSERT_FALSE(closest_names("Shpae", names).empty());
  EXPECT_EQ(closest_names("shape", names)[0], "Shape");
  EXPECT_TRUE(closest_names("Frobnicate", names).empty());
}

RC_GTEST_PROP(Tokenizer, FloatsSurviveTheRoundTrip, (const std::vector<uint32_t>& bits)) {
  std::string text;
  std::vector<float> expected;
  for (const uint32_t b : bits) {
    const float f = std::bit_cast<float>(b);
    if (!std::isfinite(f)) continue;
    char buffer[64];
    text.append(buffer, std::to_chars(buffer, buffer + 64, f).ptr).append(b % 2 ? " " : "\n#c\n");
    expected.push_back(f);
  }
  RC_ASSERT(numbers_of<float>(text) == expected);
}

RC_GTEST_PROP(Tokenizer, LocationsFindTheWords, (const std::vector<uint8_t>& bytes)) {
  std::string text;
  for (const uint8_t b : bytes) text += "ab \n\t[]#\"\r"[b % 10];
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  }
  Tokenizer tokenizer(text, "t");
  try {
    for (Token t = tokenizer.next(); t.kind != Kind::end; t = tokenizer.next()) {
      const size_t quote = t.kind == Kind::string;
      RC_ASSERT(lines.at(t.loc.line - 1).substr(t.loc.column - 1 + quote, t.text.size()) == t.text);
    }
  } catch (const InputError&) {
    RC_ASSERT(text.find('"') != std::string::npos);
  }
}

}  // namespace
}  // namespace dapple::scenefile
