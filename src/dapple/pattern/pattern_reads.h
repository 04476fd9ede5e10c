// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/pattern_value.h"

namespace dapple::pattern {

// What can be told of a pattern without running it. Time in proportion to the nodes that it needs.

TextureReads pattern_reads(const PatternFloat& pattern);
/// The picture, if the pattern is one channel of one over an affine map of u and of v.
std::optional<UvImage> pattern_uv_image(const PatternFloat& pattern);

}  // namespace dapple::pattern
