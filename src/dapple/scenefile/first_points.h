// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Positions at the head of a mesh file (PLY, OBJ or table of disks, by its name; plain or gzip), for an estimate of
/// where it lies: of the first 64 KiB. Empty for what cannot be read: whoever reads the whole file says why.
std::vector<V3d> first_points(const std::string& path);

}  // namespace dapple::scenefile
