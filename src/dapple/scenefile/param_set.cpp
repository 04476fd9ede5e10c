// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/param_set.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

constexpr size_t index_above = 16;  // fewer parameters are found faster by looking at each
constexpr size_t max_asked = 64;
constexpr size_t max_reported = 8;

size_t hash_of(std::string_view name) {
  return std::hash<std::string_view>()(name);
}

size_t value_count(const Param& p) {
  return p.numbers.size() + p.integers.size() + p.strings.size();
}

std::string values_text(size_t n) {
  return std::to_string(n) + (n == 1 ? " value" : " values");
}

[[noreturn]] void wrong(const Param& p, const std::string& expected) {
  throw InputError(p.loc, "parameter " + in_quotes(p.name) + ": expected " + expected + ", found type \"" +
                              std::string(name_of(p.type)) + "\" with " + values_text(value_count(p)));
}

std::string type_text(ParamType type) {
  return "type \"" + std::string(name_of(type)) + "\"";
}

}  // namespace

std::string_view name_of(ParamType type) {
  switch (type) {
    case ParamType::boolean:
      return "bool";
    case ParamType::integer:
      return "integer";
    case ParamType::real:
      return "float";
    case ParamType::point2:
      return "point2";
    case ParamType::vector2:
      return "vector2";
    case ParamType::point3:
      return "point3";
    case ParamType::vector3:
      return "vector3";
    case ParamType::normal:
      return "normal";
    case ParamType::string:
      return "string";
    case ParamType::texture:
      return "texture";
    case ParamType::rgb:
      return "rgb";
    case ParamType::blackbody:
      return "blackbody";
    case ParamType::spectrum:
      return "spectrum";
  }
  return "unknown";
}

std::optional<FileLoc> ParamSet::add(Param p) {
  const std::optional<Param> before = replace(std::move(p));
  return before ? std::optional(before->loc) : std::nullopt;
}

std::optional<Param> ParamSet::take(std::string_view name) {
  const Param* const p = own(name);
  if (!p) return std::nullopt;
  const auto at = params_.begin() + (p - params_.data());
  std::optional<Param> taken = std::move(*at);
  params_.erase(at);
  std::fill(slots_.begin(), slots_.end(), 0);
  if (!slots_.empty())
    for (uint32_t i = 0; i < params_.size(); ++i) index(i);
  return taken;
}

std::optional<Param> ParamSet::replace(Param p) {
  if (const Param* first = own(p.name)) return std::exchange(params_[size_t(first - params_.data())], std::move(p));
  params_.push_back(std::move(p));
  if (params_.size() <= index_above) return std::nullopt;
  if (params_.size() * 2 > slots_.size()) {
    slots_.assign(slots_.empty() ? index_above * 4 : slots_.size() * 2, 0);
    for (uint32_t i = 0; i < params_.size(); ++i) index(i);
  } else {
    index(uint32_t(params_.size() - 1));
  }
  return std::nullopt;
}

void ParamSet::index(uint32_t i) {
  const size_t mask = slots_.size() - 1;
  size_t slot = hash_of(params_[i].name) & mask;
  while (slots_[slot] != 0) slot = (slot + 1) & mask;
  slots_[slot] = i + 1;
}

const Param* ParamSet::own(std::string_view name) const {
  if (slots_.empty()) {
    for (const Param& p : params_)
      if (p.name == name) return &p;
    return nullptr;
  }
  const size_t mask = slots_.size() - 1;
  for (size_t slot = hash_of(name) & mask; slots_[slot] != 0; slot = (slot + 1) & mask) {
    const Param& p = params_[slots_[slot] - 1];
    if (p.name == name) return &p;
  }
  return nullptr;
}

const Param* ParamSet::lookup(std::string_view name) const {
  if (const Param* p = own(name)) {
    p->used = true;
    return p;
  }
  return defaults_ ? defaults_->own(name) : nullptr;
}

const Param* ParamSet::find(std::string_view name) const {
  // Without parameters there is nothing to report, and most shapes of a large scene have none but a mesh's.
  if (!params_.empty() && asked_.size() < max_asked && std::find(asked_.begin(), asked_.end(), name) == asked_.end())
    asked_.emplace_back(name);
  return lookup(name);
}

const Param* ParamSet::find(std::string_view name, ParamType type) const {
  const Param* own_param = own(name);
  const bool was_used = own_param && own_param->used;
  const Param* p = find(name);
  if (!p || p->type == type) return p;
  if (own_param) own_param->used = was_used;
  return nullptr;
}

const Param* ParamSet::typed(std::string_view name, ParamType type, size_t values) const {
  const Param* p = find(name);
  if (p && (p->type != type || value_count(*p) != values)) wrong(*p, type_text(type) + " with " + values_text(values));
  return p;
}

const std::string& ParamSet::item_name() const {
  static const std::string none;
  const Param* const p = lookup("name");
  if (!p) return none;
  if (p->type != ParamType::string || p->strings.size() != 1) wrong(*p, "type \"string\" with 1 value");
  return p->strings[0];
}

bool ParamSet::get_bool(std::string_view name, bool fallback) const {
  const Param* p = typed(name, ParamType::boolean, 1);
  return p ? p->integers[0] != 0 : fallback;
}

int32_t ParamSet::get_int(std::string_view name, int32_t fallback) const {
  const Param* p = typed(name, ParamType::integer, 1);
  return p ? p->integers[0] : fallback;
}

float ParamSet::get_float(std::string_view name, float fallback) const {
  const Param* p = typed(name, ParamType::real, 1);
  if (p && !std::isfinite(p->numbers[0])) wrong(*p, "a finite number");
  return p ? p->numbers[0] : fallback;
}

std::string ParamSet::get_string(std::string_view name, const std::string& fallback) const {
  const Param* p = typed(name, ParamType::string, 1);
  return p ? p->strings[0] : fallback;
}

V2f ParamSet::get_point2(std::string_view name, const V2f& fallback) const {
  const Param* p = typed(name, ParamType::point2, 2);
  return p ? V2f(p->numbers[0], p->numbers[1]) : fallback;
}

V3f ParamSet::get_vector3(std::string_view name, const V3f& fallback) const {
  const Param* p = typed(name, ParamType::vector3, 3);
  return p ? V3f(p->numbers[0], p->numbers[1], p->numbers[2]) : fallback;
}

V3d ParamSet::get_point3(std::string_view name, const V3d& fallback) const {
  const Param* p = typed(name, ParamType::point3, 3);
  return p ? p->base + V3d(p->numbers[0], p->numbers[1], p->numbers[2]) : fallback;
}

V3d ParamSet::base_of(std::string_view name) const {
  const Param* p = find(name);
  return p ? p->base : V3d(0, 0, 0);
}

int ParamSet::get_choice(std::string_view name, const std::vector<std::string_view>& legal, int fallback) const {
  const Param* p = typed(name, ParamType::string, 1);
  if (!p) return fallback;
  const auto it = std::find(legal.begin(), legal.end(), p->strings[0]);
  if (it == legal.end())
    throw InputError(
        p->loc, "parameter " + in_quotes(name) + ": " + in_quotes(p->strings[0]) + " is unknown; " + one_of(legal));
  return int(it - legal.begin());
}

std::span<const float> ParamSet::tuples(std::string_view name, ParamType type, size_t size) const {
  const Param* p = find(name);
  if (!p) return {};
  if (p->type != type || p->numbers.size() % size != 0)
    wrong(*p, type_text(type) + (size > 1 ? " with a multiple of " + std::to_string(size) + " values" : ""));
  return p->numbers;
}

std::span<const float> ParamSet::get_floats(std::string_view name) const {
  return tuples(name, ParamType::real, 1);
}

std::vector<double> ParamSet::get_doubles(std::string_view name) const {
  const auto floats = get_floats(name);
  const Param* p = find(name);
  if (floats.size() > most_exact) wrong(*p, "at most " + std::to_string(most_exact) + " numbers");
  return p && !p->exact.empty() ? p->exact : std::vector<double>(floats.begin(), floats.end());
}

std::span<const float> ParamSet::get_points2(std::string_view name) const {
  return tuples(name, ParamType::point2, 2);
}
std::span<const float> ParamSet::get_points3(std::string_view name) const {
  return tuples(name, ParamType::point3, 3);
}
std::span<const float> ParamSet::get_normals(std::string_view name) const {
  return tuples(name, ParamType::normal, 3);
}
std::span<const float> ParamSet::get_vectors3(std::string_view name) const {
  return tuples(name, ParamType::vector3, 3);
}

std::span<const int32_t> ParamSet::get_ints(std::string_view name) const {
  const Param* p = find(name);
  if (!p) return {};
  if (p->type != ParamType::integer) wrong(*p, type_text(ParamType::integer));
  return p->integers;
}

std::span<const std::string> ParamSet::get_strings(std::string_view name) const {
  const Param* p = find(name);
  if (!p) return {};
  if (p->type != ParamType::string) wrong(*p, type_text(ParamType::string));
  return p->strings;
}

void ParamSet::report_unused(std::string_view what, Diagnostics& diagnostics) const {
  const std::vector<std::string> asked = std::exchange(asked_, {});
  const std::vector<std::string_view> legal(asked.begin(), asked.end());
  const std::string of(what);
  const Param* first_left_out = nullptr;
  size_t reported = 0, left_out = 0;
  for (const Param& p : params_) {
    if (p.used) continue;
    if (reported == max_reported) {
      if (left_out++ == 0) first_left_out = &p;
      continue;
    }
    ++reported;
    const std::string name = in_quotes(p.name);
    diagnostics.warn(p.loc,
                     "parameter " + name + " of " + of + " is not used; " +
                         (legal.empty() ? std::string("it takes none") : one_of(legal)),
                     "unused " + of + " " + name);
  }
  if (left_out > 0)
    diagnostics.warn(first_left_out->loc, std::to_string(left_out) + " more parameters of " + of + " are not used",
                     "more unused " + of);
}

}  // namespace dapple::scenefile
