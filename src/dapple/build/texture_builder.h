// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/texture_inputs.h"

namespace dapple::build {

/// Makes the pattern of one Texture directive: pbrt-v4's types, parameters and defaults, and those of pattern_nodes.h.
/// An unknown type throws InputError with the list of known ones.
pattern::PatternFloat make_float_pattern(const TextureInputs& in);
pattern::PatternColor make_color_pattern(const TextureInputs& in);

}  // namespace dapple::build
