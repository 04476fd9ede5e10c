// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/tokenizer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

enum CharClass : uint8_t { plain, space, delimiter };

constexpr std::array<CharClass, 256> char_classes = [] {
  std::array<CharClass, 256> classes{};
  for (const char c : {' ', '\t', '\n', '\r', '\f', '\v'}) classes[uint8_t(c)] = space;
  for (const char c : {'"', '[', ']', '#'}) classes[uint8_t(c)] = delimiter;
  return classes;
}();

CharClass class_of(char c) {
  return char_classes[uint8_t(c)];
}

const char* word_end(const char* p, const char* end) {
  while (p < end && class_of(*p) == plain) ++p;
  return p;
}

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// from_chars reports overflow and underflow alike; underflow is harmless. Double tells them apart for all but absurd
// exponents.
template <class T>
bool underflows(const char* begin, const char* end) {
  double wide = 0;
  if (std::from_chars(begin, end, wide).ec == std::errc()) return std::abs(wide) < 1;
  const std::string_view word(begin, size_t(end - begin));
  const size_t exponent = word.find_first_of("eE");
  return exponent != std::string_view::npos && word.substr(exponent + 1, 1) == "-";
}

// One number that fills [begin, word end). Returns the end of the word, or nullptr with *why set.
template <class T>
const char* parse_number(const char* begin, const char* end, T* value, const char** why) {
  const char* p = begin;
  if (p < end && *p == '+') ++p;
  const char* const digits = p < end && *p == '-' && p == begin ? p + 1 : p;
  const bool begins_well =
      digits < end && (is_digit(*digits) || *digits == '.');  // from_chars would take "inf" and "nan"
  const auto [stop, error] = std::from_chars(p, end, *value);
  const bool ends_well = stop == end || class_of(*stop) != plain;
  if (begins_well && ends_well && error == std::errc()) [[likely]] {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(*value)) {
        *why = "is too large";
        return nullptr;
      }
    }
    return stop;
  }
  if constexpr (std::is_floating_point_v<T>) {
    if (begins_well && ends_well && error == std::errc::result_out_of_range && underflows<T>(p, stop)) {
      *value = 0;
      return stop;
    }
    *why = error == std::errc::result_out_of_range ? "is too large" : "is not a finite number";
  } else {
    *why = error == std::errc::result_out_of_range ? "does not fit a 32-bit integer" : "is not an integer";
  }
  return nullptr;
}

}  // namespace

Tokenizer::Tokenizer(std::string_view text, std::string_view file)
    : next_(text.data()), end_(text.data() + text.size()), line_start_(text.data()), file_(file) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw InputError(loc(), "the file is UTF-16; expected UTF-8 or ASCII");
  if (text.starts_with("\xef\xbb\xbf")) line_start_ = next_ += 3;
}

void Tokenizer::skip_space() {
  for (; next_ < end_; ++next_) {
    if (*next_ == '\n') {
      ++line_;
      line_start_ = next_ + 1;
    } else if (*next_ == '#') {
      while (next_ + 1 < end_ && next_[1] != '\n') ++next_;
    } else if (class_of(*next_) != space) {
      return;
    }
  }
}

Token Tokenizer::next() {
  skip_space();
  Token token;
  token.loc = loc_of(next_);
  if (next_ == end_) return token;
  if (*next_ == '"') return next_string();
  const char* const begin = next_;
  if (*next_ == '[' || *next_ == ']') {
    token.kind = *next_ == '[' ? Token::Kind::open : Token::Kind::close;
    ++next_;
  } else {
    token.kind = Token::Kind::word;
    next_ = word_end(next_, end_);
  }
  token.text = {begin, size_t(next_ - begin)};
  return token;
}

Token Tokenizer::next_string() {
  Token token;
  token.kind = Token::Kind::string;
  token.loc = loc_of(next_);
  const char* p = next_ + 1;
  for (; p < end_ && *p != '"' && *p != '\n'; ++p)
    if (*p == '\\') {
      token.has_escapes = true;
      if (p + 1 < end_ && p[1] != '\n') ++p;
    }
  if (p == end_ || *p != '"') throw InputError(token.loc, "the string does not end on its line; expected a closing \"");
  token.text = {next_ + 1, size_t(p - next_ - 1)};
  next_ = p + 1;
  return token;
}

Token::Kind Tokenizer::peek() {
  skip_space();
  if (next_ == end_) return Token::Kind::end;
  switch (*next_) {
    case '"':
      return Token::Kind::string;
    case '[':
      return Token::Kind::open;
    case ']':
      return Token::Kind::close;
    default:
      return Token::Kind::word;
  }
}

template <class T>
void Tokenizer::read_numbers_of(std::vector<T>* out, size_t most) {
  for (; most > 0; --most) {
    skip_space();
    if (next_ == end_ || class_of(*next_) == delimiter) return;
    T value;
    const char* why = nullptr;
    const char* const stop = parse_number(next_, end_, &value, &why);
    if (!stop) {
      const std::string_view word(next_, size_t(word_end(next_, end_) - next_));
      throw InputError(loc_of(next_), in_quotes(word) + " " + why);
    }
    out->push_back(value);
    next_ = stop;
  }
}

void Tokenizer::read_numbers(std::vector<float>* out, size_t most) {
  read_numbers_of(out, most);
}
void Tokenizer::read_numbers(std::vector<double>* out, size_t most) {
  read_numbers_of(out, most);
}
void Tokenizer::read_numbers(std::vector<int32_t>* out, size_t most) {
  read_numbers_of(out, most);
}

std::string string_of(const Token& token) {
  if (!token.has_escapes) return std::string(token.text);
  std::string s;
  for (size_t i = 0; i < token.text.size(); ++i) {
    char c = token.text[i];
    if (c == '\\' && i + 1 < token.text.size()) {
      static constexpr std::string_view codes = "bfnrt\\\"'", meanings = "\b\f\n\r\t\\\"'";
      const size_t code = codes.find(token.text[++i]);
      if (code == std::string_view::npos)
        throw InputError(token.loc, "unknown escape in the string " + in_quotes(token.text));
      c = meanings[code];
    }
    s += c;
  }
  return s;
}

std::string describe(const Token& token) {
  return token.kind == Token::Kind::end ? std::string("the end of the file") : in_quotes(token.text);
}

}  // namespace dapple::scenefile
