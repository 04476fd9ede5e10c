// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "dapple/image/exr_file.h"

namespace dapple::denoise {

/// Three channels of a part that belong together, as red, green, blue or x, y, z.
struct Layer {
  std::string name;  ///< what stands before the channels' last dot; empty for the main picture of many files
  size_t part = 0;
  std::array<size_t, 3> channels{};
};

/// One channel of a part.
struct ChannelPlace {
  size_t part = 0, channel = 0;
};

/// A picture to denoise, and what belongs to it.
struct Picture {
  Layer colour;  ///< what becomes denoised
  Layer noisy;   ///< what is read: colour, or what was kept of it before it was denoised
  std::optional<Layer> albedo, normal;
  std::optional<ChannelPlace> depth;
  std::optional<Layer> motion;       ///< AOV of Dapple, where the header says that it is one
  std::optional<Layer> motion_back;  ///< likewise
  std::optional<Layer> direct;       ///< likewise: the part of noisy that is direct light
  std::optional<Layer> variance;     ///< likewise
  std::vector<Layer> light_groups;   ///< Dapple's, "light.NAME"
};

/// Pictures in a file, with the names that renderers give to layers: Dapple (R; noisy.R, albedo.R, normal.X,
/// light.NAME.R), Cycles (View.Combined.R, View.Noisy Image.R, View.Denoising Albedo.R, View.Denoising Normal.X, for
/// each view layer), pbrt-v4 (Albedo.R, Ns.X before N.X), RenderMan (Ci.r, albedo.r, normal.r) and others that are
/// alike but for spaces, underscores and capitals; depth is Z, Depth.Z or the like, but not the Z of
/// X, Y, Z. In files of many parts, part names
/// stand for what channels leave out. Where one picture has albedo or normals only those that have are given.
std::vector<Picture> find_pictures(const image::ExrFile& file);

/// All names of layers, for messages: "R G B, albedo, normal".
std::string list_layers(const image::ExrFile& file);

}  // namespace dapple::denoise
