// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "dapple/base/error.h"
#include "dapple/light/shaft_light.h"

namespace dapple::build {

/// What is said about light shafts; what is not said is empty.
struct ShaftRequest {
  std::optional<std::string> shafts;      ///< "rays" or "scan-planes"
  std::optional<std::string> scattering;  ///< "single" or "all"
  std::optional<int> planes, bins;
  std::optional<float> mb;

  ShaftRequest over(const ShaftRequest& other) const;
  /// InputError at `loc` for what is out of range. The names are what the user calls the five.
  void check(const FileLoc& loc, const std::array<std::string_view, 5>& names) const;
};

inline constexpr std::string_view shaft_names[] = {"rays", "scan-planes"};

/// The scan planes asked for. Where nothing is said, those that apply if `by_default`; null without. With a warning
/// null where they were asked for and do not apply. The scene must outlive them.
std::shared_ptr<const light::ShaftLight> make_shafts(const scene::Scene& scene, const ShaftRequest& request,
                                                     bool by_default, uint64_t seed);

}  // namespace dapple::build
