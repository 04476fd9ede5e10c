// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Disks as the RAMI intercomparison lists its leaves (Widlowski et al. 2007): one a line, radius, centre x y z, normal
/// x y z, between spaces. All numbers are finite, radii above 0, normals unit.
struct DiskTable {
  std::vector<float> radius;
  std::vector<V3f> centre, normal;
  V3d base{0, 0, 0};  ///< to be added to each centre (far_points.h)
};

/// Reads such a file (plain or gzip); empty lines and what follows a # are skipped. InputError at `loc`, naming file,
/// line and number, if it is damaged. Memory stays in proportion to the file.
DiskTable read_disks(const std::string& path, const FileLoc& loc);
/// The same from memory; `name` stands for the file in messages.
DiskTable parse_disks(std::string_view data, std::string_view name, const FileLoc& loc);

}  // namespace dapple::scenefile
