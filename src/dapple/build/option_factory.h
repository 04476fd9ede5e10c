// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "dapple/build/build_context.h"

namespace dapple::build {

/// The scene's Option directives, but for "shadingrate" (geometry_builder.cpp). Both throw InputError for values of the
/// wrong type.
std::optional<uint64_t> scene_seed(const BuildContext& context);
/// False: camera samples are at the centres of pixels, of the lens and of the time that the shutter is open.
bool has_pixel_jitter(const BuildContext& context);

/// Names Option directives that are not supported, and those that are not known.
void report_options(const BuildContext& context);

}  // namespace dapple::build
