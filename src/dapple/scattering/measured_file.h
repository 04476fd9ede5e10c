// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "dapple/scattering/measured_table.h"

namespace dapple::scattering {

/// Reads measured reflection from the bytes of a file: tensor files (.bsdf, of the RGL database; with "rgb" values, or
/// "spectra", which become the RGB of what they reflect of daylight) or MERL's binary tables (.binary). Throws
/// std::runtime_error with a message where the bytes are neither, or damaged: every count and offset is checked, and no
/// more memory is taken than about three times what the file has.
std::shared_ptr<const MeasuredTable> read_measured(std::span<const std::byte> file);

}  // namespace dapple::scattering
