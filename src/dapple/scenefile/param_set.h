// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Declared type of a parameter as written in the file.
enum class ParamType {
  boolean, integer, real, point2, vector2, point3, vector3, normal, string, texture,
  rgb,        ///< three numbers
  blackbody,  ///< kelvin
  spectrum    ///< wavelength (nm), value pairs in `numbers`, or the name of a spectrum or file in `strings`
};

std::string_view name_of(ParamType type);

/// One parameter: `"float radius" [ 2 ]`.
struct Param {
  ParamType type = ParamType::real;
  std::string name;
  FileLoc loc;
  std::vector<float> numbers;      ///< real, point*, vector*, normal, rgb, blackbody, spectrum
  std::vector<int32_t> integers;   ///< integer; boolean as 0 and 1
  std::vector<std::string> strings;  ///< string, texture, named spectrum
  mutable bool used = false;       ///< set by look-ups
};

/// Parameters of one directive. Look-ups mark a parameter as used; report_unused() names the rest. A look-up by the wrong type or with the
/// wrong number of values throws InputError naming what was expected. A name given twice keeps the first and is an error in strict reading
/// (as pbrt: the parser reports it).
class ParamSet {
 public:
  void add(Param p);
  bool empty() const { return params_.empty(); }
  std::span<const Param> all() const { return params_; }

  /// The parameter of this name and any type, marked as used, or nullptr.
  const Param* find(std::string_view name) const;
  /// The parameter of this name and type, marked as used, or nullptr (also where the name has another type).
  const Param* find(std::string_view name, ParamType type) const;

  bool get_bool(std::string_view name, bool fallback) const;
  int32_t get_int(std::string_view name, int32_t fallback) const;
  float get_float(std::string_view name, float fallback) const;  ///< finite, else InputError
  std::string get_string(std::string_view name, const std::string& fallback) const;
  V2f get_point2(std::string_view name, const V2f& fallback) const;
  V3f get_vector3(std::string_view name, const V3f& fallback) const;  ///< vector3 or vector
  V3f get_point3(std::string_view name, const V3f& fallback) const;   ///< point3 or point
  /// The string's place in `legal`; InputError with the list of legal names otherwise.
  int get_choice(std::string_view name, const std::vector<std::string_view>& legal, int fallback) const;

  std::span<const float> get_floats(std::string_view name) const;
  std::span<const int32_t> get_ints(std::string_view name) const;
  std::span<const std::string> get_strings(std::string_view name) const;
  /// Flat coordinates; InputError unless the count is a multiple of the type's size.
  std::span<const float> get_points2(std::string_view name) const;  ///< 2 a point
  std::span<const float> get_points3(std::string_view name) const;  ///< 3 a point
  std::span<const float> get_normals(std::string_view name) const;
  std::span<const float> get_vectors3(std::string_view name) const;

  /// Names every parameter no look-up asked for, with the legal names (those that were asked for): one warning per `what` and name.
  void report_unused(std::string_view what, Diagnostics& diagnostics) const;

 private:
  const Param* typed(std::string_view name, ParamType type, size_t values) const;

  std::vector<Param> params_;
  mutable std::vector<std::string> asked_;
};

}  // namespace dapple::scenefile
