// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/build/texture_factory.h"
#include "dapple/pattern/patterns.h"

namespace dapple::build {

// Parameters of textures, read from a scene. Helpers of TextureLibrary and TextureInputs.

/// A colour given by any of the ways of writing a spectrum. InputError for other types.
RGB spectrum_value(const scenefile::Param& param, TextureRole role, const BuildContext& context);

/// What an imagemap directive asks for, its mapping apart.
struct ImageParams {
  std::string path;
  FileLoc loc;  ///< of the file name
  image::Encoding encoding;
  pattern::ImageTextureOptions options;
  bool weigh_by_alpha = true;  ///< of colours: see image::TextureWeight
};
ImageParams image_params(const scenefile::TextureEntity& entity, const BuildContext& context);

/// Warns, once a file, of numbers that are none.
void warn_of_not_numbers(size_t count, const std::string& path, const FileLoc& loc, const BuildContext& context);

/// What stands in for images that cannot be read: magenta and black squares, ten to the unit.
pattern::PatternColor missing_image(pattern::PatternGraph& graph);
/// The warning that goes with it.
void warn_of_stand_in(const InputError& error, const FileLoc& loc, const std::string& stand_in,
                      const BuildContext& context);

}  // namespace dapple::build
