// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "dapple/scene/film.h"

namespace dapple::render {

/// Pictures of what the radiosity cache did (docs/guide/troubleshooting.md has the legend).
enum class CacheView { level, age, fills, reuse };
inline constexpr std::string_view cache_view_names[] = {"level", "age", "fills", "reuse"};

/// The false colour of a pixel, linear. Level: blue coarse, green medium, red fine, white hits shaded by themselves,
/// mixed by shares. The others: from dark blue to pale yellow, the brighter the more the cache worked in vain; grey
/// where no entry was read.
RGB cache_color(CacheView view, const scene::CacheFeatures& use);

}  // namespace dapple::render
