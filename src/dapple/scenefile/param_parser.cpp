// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/param_parser.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "dapple/scenefile/far_points.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

using Kind = Token::Kind;

struct TypeName {
  std::string_view name;
  ParamType type;
};

constexpr std::array type_names = {
    TypeName{"float", ParamType::real},
    TypeName{"integer", ParamType::integer},
    TypeName{"point3", ParamType::point3},
    TypeName{"string", ParamType::string},
    TypeName{"rgb", ParamType::rgb},
    TypeName{"texture", ParamType::texture},
    TypeName{"bool", ParamType::boolean},
    TypeName{"spectrum", ParamType::spectrum},
    TypeName{"point2", ParamType::point2},
    TypeName{"normal", ParamType::normal},
    TypeName{"vector3", ParamType::vector3},
    TypeName{"vector2", ParamType::vector2},
    TypeName{"blackbody", ParamType::blackbody},
    TypeName{"point", ParamType::point3},
    TypeName{"vector", ParamType::vector3},
    TypeName{"normal3", ParamType::normal},
};

ParamType type_of(std::string_view name, const FileLoc& loc) {
  for (const TypeName& t : type_names)
    if (t.name == name) return t.type;
  if (name == "color") throw InputError(loc, "parameter type \"color\" is of an older format; write \"rgb\"");
  if (name == "xyz")
    throw InputError(loc, "parameter type \"xyz\" is of an older format; convert the value and write \"rgb\"");
  std::vector<std::string_view> names;
  for (const TypeName& t : type_names) names.push_back(t.name);
  throw InputError(loc, "unknown parameter type " + in_quotes(name) + "; " + one_of(names));
}

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

// `"type name"` to a Param without values.
Param declaration_of(const Token& token) {
  const std::string text = string_of(token);
  const auto begin = std::find_if_not(text.begin(), text.end(), is_blank);
  const auto type_end = std::find_if(begin, text.end(), is_blank);
  const auto name_begin = std::find_if_not(type_end, text.end(), is_blank);
  const auto name_end = std::find_if(name_begin, text.end(), is_blank);
  if (name_begin == text.end() || std::find_if_not(name_end, text.end(), is_blank) != text.end())
    throw InputError(token.loc, "expected a parameter as \"type name\", found " + in_quotes(text));
  Param p;
  p.type = type_of(std::string_view(begin, type_end), token.loc);
  p.name.assign(name_begin, name_end);
  p.loc = token.loc;
  return p;
}

bool holds_strings(ParamType type) {
  return type == ParamType::string || type == ParamType::texture;
}

[[noreturn]] void wrong_value(const Token& token, const Param& param, const char* expected) {
  throw InputError(token.loc, "parameter " + in_quotes(param.name) + " of type \"" + std::string(name_of(param.type)) +
                                  "\": expected " + expected + ", found " + describe(token));
}

// pbrt takes disable_pixel_jitter, disable-pixel-jitter and disablepixeljitter for the same.
std::string normalized_option(std::string name) {
  std::erase_if(name, [](char c) { return c == '_' || c == '-'; });
  for (char& c : name) c = char(std::tolower(uint8_t(c)));
  return name;
}

}  // namespace

void ParamParser::read_words(Tokenizer* tokenizer, size_t most, Param* param) {
  for (; most > 0; --most) {
    const Kind kind = tokenizer->peek();
    if (kind != Kind::string && kind != Kind::word) return;
    const Token token = tokenizer->next();
    if (param->type == ParamType::boolean) {
      if (token.text != "true" && token.text != "false") wrong_value(token, *param, "true or false");
      param->integers.push_back(token.text == "true");
    } else {
      if (kind != Kind::string) wrong_value(token, *param, "a string in quotes");
      param->strings.push_back(string_of(token));
    }
  }
}

void ParamParser::read_values(Tokenizer* tokenizer, size_t most, Param* param) {
  const bool spectrum_name = param->type == ParamType::spectrum && tokenizer->peek() == Kind::string;
  if (param->type == ParamType::boolean || holds_strings(param->type) || spectrum_name) {
    read_words(tokenizer, most, param);
  } else if (param->type == ParamType::integer) {
    integers_.clear();
    tokenizer->read_numbers(&integers_, most);
    param->integers = integers_;
  } else {
    numbers_.clear();
    Tokenizer again = *tokenizer;
    tokenizer->read_numbers(&numbers_, most);
    param->numbers = numbers_;
    const bool is_short = param->type == ParamType::real && numbers_.size() <= ParamSet::most_exact;
    if ((!is_short && (param->type != ParamType::point3 || numbers_.size() % 3 != 0)) || !may_be_far(numbers_)) return;
    if (is_short) return again.read_numbers(&param->exact, most);
    std::vector<double> exact;
    again.read_numbers(&exact, most);
    param->base = take_off_base(exact, param->numbers);
  }
}

Param ParamParser::parse_param(Tokenizer* tokenizer, ColorSpace color_space) {
  Param p = declaration_of(tokenizer->next());
  p.color_space = color_space;
  if (tokenizer->peek() == Kind::open) {
    tokenizer->next();
    read_values(tokenizer, SIZE_MAX, &p);
    const Token close = tokenizer->next();
    if (close.kind != Kind::close) wrong_value(close, p, "more values or \"]\"");
  } else {
    read_values(tokenizer, 1, &p);
    if (p.numbers.empty() && p.integers.empty() && p.strings.empty())
      wrong_value(tokenizer->next(), p, "a value or \"[\"");
  }
  if (p.type == ParamType::spectrum && p.strings.empty() && (p.numbers.empty() || p.numbers.size() % 2 != 0))
    throw InputError(p.loc, "parameter " + in_quotes(p.name) +
                                " of type \"spectrum\": expected pairs of wavelength and value or a name, found " +
                                std::to_string(p.numbers.size()) + " numbers");
  return p;
}

void ParamParser::parse_list(Tokenizer* tokenizer, ColorSpace color_space, ParamSet* set, Diagnostics* diagnostics) {
  while (tokenizer->peek() == Kind::string) {
    Param p = parse_param(tokenizer, color_space);
    const std::string name = in_quotes(p.name);
    const FileLoc loc = p.loc;
    if (const auto first = set->add(std::move(p)))
      diagnostics->warn(
          loc, "parameter " + name + " is given twice, first at " + first->to_string() + "; the last value counts",
          "twice " + name);
  }
}

Param ParamParser::parse_option(Tokenizer* tokenizer) {
  const Token name = tokenizer->next();
  if (name.kind != Kind::string)
    throw InputError(name.loc, "Option: expected a name in quotes, found " + describe(name));
  Param p;
  p.loc = name.loc;
  // Written like a parameter, "float seed", it says its type.
  if (name.text.find(' ') != std::string_view::npos) {
    p = declaration_of(name);
    const bool in_brackets = tokenizer->peek() == Kind::open;
    if (in_brackets) tokenizer->next();
    read_values(tokenizer, in_brackets ? SIZE_MAX : 1, &p);
    if (in_brackets)
      if (const Token close = tokenizer->next(); close.kind != Kind::close)
        wrong_value(close, p, "more values or \"]\"");
  } else {
    p.name = string_of(name);
    if (tokenizer->peek() == Kind::string) {
      p.type = ParamType::string;
      read_words(tokenizer, 1, &p);
    } else if (const Kind kind = tokenizer->peek(); kind == Kind::word) {
      Tokenizer ahead = *tokenizer;
      const Token value = ahead.next();
      const std::string_view word = value.text;
      const bool is_bool = word == "true" || word == "false";
      if (!is_bool && word.find_first_of("0123456789") > 2) wrong_value(value, p, "a value");
      const bool is_real = word.find_first_of(".eE") != std::string_view::npos;
      p.type = is_bool ? ParamType::boolean : is_real ? ParamType::real : ParamType::integer;
      read_values(tokenizer, 1, &p);
    }
  }
  p.name = normalized_option(std::move(p.name));
  if (p.numbers.empty() && p.integers.empty() && p.strings.empty()) wrong_value(tokenizer->next(), p, "a value");
  return p;
}

}  // namespace dapple::scenefile
