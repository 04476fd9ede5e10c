// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "dapple/base/transform.h"
#include "dapple/scenefile/param_set.h"

namespace dapple::scenefile {

/// Pieces of the scene language, such that reading gives the same numbers and strings.
std::string quote(std::string_view text);
std::string text_of(double number);
std::string text_of(const Param& param);  ///< ` "type name" [ ... ]`, from a space on
std::string text_of(const Transform& t);  ///< `[ 16 numbers ]` as Transform takes them

}  // namespace dapple::scenefile
