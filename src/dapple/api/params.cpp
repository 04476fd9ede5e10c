// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>

#include "dapple/api/scene_impl.h"
#include "dapple/base/transform.h"
#include "dapple/scenefile/scene_writing.h"

namespace dapple {

namespace {

Transform transform_of(const std::array<double, 16>& m) {
  return Transform(
      M44d(m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]));
}

Placement placement_of(const Transform& t) {
  Placement p;
  for (int i = 0; i < 16; ++i) p.matrix[size_t(i)] = t.matrix()[i % 4][i / 4];
  return p;
}

template <class T>
std::string list(const T& values) {
  std::string out;
  for (const auto& v : values) {
    if constexpr (!std::is_integral_v<std::decay_t<decltype(v)>>)
      if (!std::isfinite(v)) throw UsageError("not a finite number: " + std::to_string(v));
    out += ' ' + scenefile::text_of(double(v));
  }
  return out;
}

}  // namespace

Placement Placement::translate(double x, double y, double z) {
  return placement_of(Transform::translate({x, y, z}));
}
Placement Placement::scale(double x, double y, double z) {
  return placement_of(Transform::scale({x, y, z}));
}
Placement Placement::rotate(double degrees, double x, double y, double z) {
  return placement_of(Transform::rotate(degrees, {x, y, z}));
}
Placement Placement::look_at(const std::array<double, 3>& eye, const std::array<double, 3>& look,
                             const std::array<double, 3>& up) {
  const Transform t = Transform::look_at({eye[0], eye[1], eye[2]}, {look[0], look[1], look[2]}, {up[0], up[1], up[2]});
  if (!t.is_finite() || !t.is_invertible())
    throw SceneError(SceneError::Kind::usage,
                     "look_at: eye and look must differ, and up must not be parallel to the direction between them");
  return placement_of(t.inverse());
}
Placement Placement::operator*(const Placement& other) const {
  return placement_of(transform_of(matrix) * transform_of(other.matrix));
}

namespace api {

std::string text_of(const Params& params) {
  std::string out;
  for (const Param& p : params) {
    try {
      out += ' ' + scenefile::quote(p.declaration) + " [";
      if (const bool* b = std::get_if<bool>(&p.value)) out += *b ? " true" : " false";
      if (const auto* v = std::get_if<std::vector<double>>(&p.value)) out += list(*v);
      if (const auto* v = std::get_if<std::span<const float>>(&p.value)) out += list(*v);
      if (const auto* v = std::get_if<std::span<const int32_t>>(&p.value)) out += list(*v);
      if (const auto* v = std::get_if<std::vector<std::string>>(&p.value))
        for (const std::string& s : *v) out += ' ' + scenefile::quote(s);
      out += " ]";
    } catch (const UsageError& error) {
      throw UsageError("parameter \"" + p.declaration + "\": " + error.what());
    }
  }
  return out;
}

std::string text_of(const Placement& placement) {
  return "Transform [" + list(placement.matrix) + " ]\n";
}

SceneError outside(const Error& error) {
  using Kind = SceneError::Kind;
  const std::string message = error.what();
  const Kind kind = error.code() == ExitCode::bad_input ? Kind::input
                    : error.code() == ExitCode::io      ? Kind::io
                    : error.code() == ExitCode::memory  ? Kind::memory
                                                        : Kind::usage;
  if (kind != Kind::input) return {kind, message};
  // "file:line:column: what is wrong"
  const size_t end = message.find(": ");
  std::string place = message.substr(0, end == std::string::npos ? 0 : end);
  int numbers[2] = {0, 0};
  for (int i = 1; i >= 0; --i) {
    const size_t colon = place.rfind(':');
    if (colon == std::string::npos || place.find_first_not_of("0123456789", colon + 1) != std::string::npos ||
        colon + 1 == place.size())
      break;
    numbers[i] = std::atoi(place.c_str() + colon + 1);
    place.resize(colon);
  }
  if (numbers[0] == 0) std::swap(numbers[0], numbers[1]);
  return {kind, message, place, numbers[0], numbers[1]};
}

}  // namespace api
}  // namespace dapple
