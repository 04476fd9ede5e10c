// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dapple::scenefile {

/// A piece of an input file for a message: in double quotes, control characters and broken UTF-8 as '?', cut after
/// `max_length` bytes. Messages must not pour out files that were never meant as scenes.
std::string in_quotes(std::string_view text, size_t max_length = 40);

/// Up to three of `names` that resemble `word`, the most similar first: what the user may have meant.
std::vector<std::string_view> closest_names(std::string_view word, std::span<const std::string_view> names);

}  // namespace dapple::scenefile
