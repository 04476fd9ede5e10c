// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

// dappleConfig.cmake says where the package was installed, for programs that are linked with it and lie elsewhere.
#ifndef DAPPLE_INSTALLED_WEIGHTS
#define DAPPLE_INSTALLED_WEIGHTS ""
#endif

namespace dapple::denoise {

// Weights that come with Dapple, by what they take: colour alone; with it albedo and normals.
inline constexpr std::string_view color_weights = "rt_hdr.tza", feature_weights = "rt_hdr_alb_nrm.tza";

/// The path of one of the weight files that come with Dapple: $DAPPLE_WEIGHTS/name where that is set; else in
/// `installed`; else share/dapple/denoise/name in a folder above the program or shared library that this code is part
/// of (a build or an installed tree, moved or not). Empty where none of these is a file.
std::string find_weights(std::string_view name, const std::string& installed = DAPPLE_INSTALLED_WEIGHTS);
/// The same. IoError where it is empty, with where it was looked for.
std::string weights_path(std::string_view name, const std::string& installed = DAPPLE_INSTALLED_WEIGHTS);

}  // namespace dapple::denoise
