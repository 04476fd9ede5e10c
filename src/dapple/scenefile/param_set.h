// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Declared type of a parameter as written in the file.
enum class ParamType {
  boolean,
  integer,
  real,
  point2,
  vector2,
  point3,
  vector3,
  normal,
  string,
  texture,
  rgb,        ///< three numbers
  blackbody,  ///< kelvin
  spectrum    ///< wavelength (nm), value pairs in `numbers`, or the name of a spectrum or file in `strings`
};

/// The word for it in a file: "bool", "integer", "float", "point3", ...
std::string_view name_of(ParamType type);

/// Primaries and white of "rgb" values (ColorSpace directive).
enum class ColorSpace : uint8_t { srgb, dci_p3, rec2020, aces2065_1 };

/// One parameter: `"float radius" [ 2 ]`. All numbers are finite.
struct Param {
  ParamType type = ParamType::real;
  ColorSpace color_space = ColorSpace::srgb;  ///< in force where the parameter stands; matters to rgb only
  std::string name;
  FileLoc loc;
  std::vector<float> numbers;  ///< real, point*, vector*, normal, rgb, blackbody, spectrum
  std::vector<double> exact;  ///< `numbers` of a short real list as written, where floats may not be enough; else empty
  V3d base{0, 0, 0};  ///< of point3: what is to be added to each point (far_points.h); 0 but far from the origin
  std::vector<int32_t> integers;     ///< integer; boolean as 0 and 1
  std::vector<std::string> strings;  ///< string, texture, named spectrum
  mutable bool used = false;         ///< set by look-ups
};

/// Parameters of one directive. Look-ups mark a parameter as used; report_unused() names the rest. A look-up by the
/// wrong type or with the wrong number of values throws InputError naming what was expected. Look-ups take constant
/// time, but because they keep a record, only one thread at a time may use a ParamSet.
///
/// Defaults (pbrt's `Attribute "shape" ...`) are shared by all directives they apply to: look-ups fall back to them;
/// they count neither as unused nor into all().
class ParamSet {
 public:
  using Defaults = std::shared_ptr<const ParamSet>;

  /// Adds it, or puts it in the place of the parameter of that name: then, where that one was given.
  std::optional<FileLoc> add(Param p);
  /// The same; returns the parameter whose place it took.
  std::optional<Param> replace(Param p);
  /// Takes the parameter of this name out, if there is one.
  std::optional<Param> take(std::string_view name);
  void set_defaults(Defaults defaults) { defaults_ = std::move(defaults); }

  bool empty() const { return params_.empty(); }
  std::span<const Param> all() const { return params_; }
  const Defaults& defaults() const { return defaults_; }

  /// The parameter of this name and any type, marked as used, or nullptr.
  const Param* find(std::string_view name) const;
  /// The parameter of this name and type, marked as used, or nullptr (also where the name has another type).
  const Param* find(std::string_view name, ParamType type) const;
  /// `"string name"`: what the user calls the item; empty without one. InputError if it is no single string. Leaves no
  /// record but that the parameter is used.
  const std::string& item_name() const;

  bool get_bool(std::string_view name, bool fallback) const;
  int32_t get_int(std::string_view name, int32_t fallback) const;
  float get_float(std::string_view name, float fallback) const;  ///< finite, else InputError
  std::string get_string(std::string_view name, const std::string& fallback) const;
  V2f get_point2(std::string_view name, const V2f& fallback) const;
  V3f get_vector3(std::string_view name, const V3f& fallback) const;  ///< vector3 or vector
  V3d get_point3(std::string_view name, const V3d& fallback) const;   ///< point3 or point
  /// The string's place in `legal`; InputError with the list of legal names otherwise.
  int get_choice(std::string_view name, const std::vector<std::string_view>& legal, int fallback) const;

  std::span<const float> get_floats(std::string_view name) const;
  /// The same as written, of at most most_exact values; InputError for more.
  std::vector<double> get_doubles(std::string_view name) const;
  static constexpr size_t most_exact = 16;
  std::span<const int32_t> get_ints(std::string_view name) const;
  std::span<const std::string> get_strings(std::string_view name) const;
  /// Flat coordinates; InputError unless the count is a multiple of the type's size.
  std::span<const float> get_points2(std::string_view name) const;  ///< 2 a point
  std::span<const float> get_points3(std::string_view name) const;  ///< 3 a point, which lies at base_of() plus these
  V3d base_of(std::string_view name) const;                         ///< Param::base; 0 where there is no such parameter
  std::span<const float> get_normals(std::string_view name) const;
  std::span<const float> get_vectors3(std::string_view name) const;

  /// Warns of every parameter no look-up asked for, with the legal names (those that were asked for): one warning per
  /// `what` and name, and after the first few only their number. `what` is the directive as the user knows it: `Shape
  /// "sphere"`. Call it last: the record of look-ups is dropped.
  void report_unused(std::string_view what, Diagnostics& diagnostics) const;

 private:
  const Param* lookup(std::string_view name) const;  // no record
  const Param* own(std::string_view name) const;
  const Param* typed(std::string_view name, ParamType type, size_t values) const;
  std::span<const float> tuples(std::string_view name, ParamType type, size_t size) const;
  void index(uint32_t i);

  std::vector<Param> params_;
  std::vector<uint32_t> slots_;  // open hash table of positions in params_ plus one; empty while there are few
  Defaults defaults_;
  mutable std::vector<std::string> asked_;
};

}  // namespace dapple::scenefile
