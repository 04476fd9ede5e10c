// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"

namespace dapple::scenefile {

/// A word of pbrt's text format. `text` points into the tokenizer's text.
struct Token {
  enum class Kind : uint8_t {
    end,     ///< of the text
    word,    ///< directive, number, true, false: anything without delimiters
    string,  ///< `text` is what stands between the quotes, escapes not yet replaced
    open,    ///< [
    close    ///< ]
  };
  Kind kind = Kind::end;
  bool has_escapes = false;  ///< string only
  std::string_view text;
  FileLoc loc;
};

/// Cuts pbrt's text into tokens, in place: nothing is copied and nothing allocated per token. White space separates
/// (line ends of any kind), # begins a comment, a UTF-8 byte order mark is skipped. Columns count bytes.
class Tokenizer {
 public:
  /// `text` and `file` must outlive the tokenizer and all it returns. InputError if it is UTF-16.
  Tokenizer(std::string_view text, std::string_view file);

  /// The next token. InputError for a string that does not end on its line.
  Token next();
  /// The kind of what next() will return.
  Token::Kind peek();

  /// Appends the numbers from here, `most` of them or up to the next bracket, string or the end. All are finite and
  /// numbers too small for a float are zero; InputError for anything else.
  void read_numbers(std::vector<float>* out, size_t most = SIZE_MAX);
  void read_numbers(std::vector<double>* out, size_t most = SIZE_MAX);
  void read_numbers(std::vector<int32_t>* out, size_t most = SIZE_MAX);

  FileLoc loc() const { return loc_of(next_); }  ///< of the place reached

 private:
  template <class T>
  void read_numbers_of(std::vector<T>* out, size_t most);
  void skip_space();
  Token next_string();
  FileLoc loc_of(const char* p) const { return {file_, line_, uint32_t(p - line_start_ + 1)}; }

  const char* next_;
  const char* const end_;
  const char* line_start_;
  uint32_t line_ = 1;
  std::string_view file_;
};

/// The string a token means: escapes (\n, \t, \", \\ and their like) replaced. InputError for unknown ones.
std::string string_of(const Token& token);

/// "end of file", `"Shape"`, ... for messages.
std::string describe(const Token& token);

}  // namespace dapple::scenefile
