// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::modelfile {

/// Makes directives as a parser would, all at one place of a file.
class Directive {
 public:
  Directive(std::string type, const FileLoc& loc) {
    entity_.type = std::move(type);
    entity_.loc = loc;
  }

  Directive& number(const char* name, double value) {
    scenefile::Param p = make(name, scenefile::ParamType::real);
    p.numbers = {float(value)};
    p.exact = {value};
    return add(std::move(p));
  }
  Directive& integer(const char* name, int32_t value) { return integers(name, std::vector<int32_t>{value}); }
  Directive& integers(const char* name, std::vector<int32_t> values) {
    scenefile::Param p = make(name, scenefile::ParamType::integer);
    p.integers = std::move(values);
    return add(std::move(p));
  }
  Directive& boolean(const char* name, bool value) {
    scenefile::Param p = make(name, scenefile::ParamType::boolean);
    p.integers = {value ? 1 : 0};
    return add(std::move(p));
  }
  Directive& rgb(const char* name, const RGB& c) {
    scenefile::Param p = make(name, scenefile::ParamType::rgb);
    p.numbers = {c.r, c.g, c.b};
    return add(std::move(p));
  }
  Directive& text(const char* name, std::vector<std::string> values) {
    scenefile::Param p = make(name, scenefile::ParamType::string);
    p.strings = std::move(values);
    return add(std::move(p));
  }
  Directive& text(const char* name, const std::string& value) { return text(name, std::vector<std::string>{value}); }
  Directive& texture(const char* name, const std::string& value) {
    scenefile::Param p = make(name, scenefile::ParamType::texture);
    p.strings = {value};
    return add(std::move(p));
  }
  Directive& floats(const char* name, scenefile::ParamType type, std::vector<float> values) {
    scenefile::Param p = make(name, type);
    p.numbers = std::move(values);
    return add(std::move(p));
  }
  Directive& point(const char* name, const V3d& v) {
    return floats(name, scenefile::ParamType::point3, {float(v.x), float(v.y), float(v.z)});
  }
  Directive& add(scenefile::Param p) {
    p.loc = entity_.loc;
    entity_.params.add(std::move(p));
    return *this;
  }

  scenefile::Entity take() { return std::move(entity_); }

 private:
  scenefile::Param make(const char* name, scenefile::ParamType type) const {
    scenefile::Param p;
    p.name = name;
    p.type = type;
    return p;
  }

  scenefile::Entity entity_;
};

}  // namespace dapple::modelfile
