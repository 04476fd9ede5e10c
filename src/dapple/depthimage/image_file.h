// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "dapple/depthimage/layered_image.h"

namespace dapple::depthimage {

/// Images of objects in a file (.dti), little-endian:
///   "dapple-trees" and four zero bytes, u32 version (1), u32 objects; for each object
///   u64 key, u32 length of the name, the name, float centre[3], radius, box[6], u32 layers,
///   u32 directions, each float[3], u32 materials, each float reflectance[3], transmittance[3], u32 levels; for each
///   level u32 resolution; for each direction u32 fragments, u32 first[resolution^2 + 1], fragments of 16 bytes as
///   Fragment is.
std::vector<std::byte> encode_images(const std::vector<ObjectImages>& objects);

/// The opposite. InputError, naming `name` and the byte, for whatever is damaged, foreign or of another version; memory
/// is taken only for what the bytes hold.
std::vector<ObjectImages> decode_images(std::span<const std::byte> bytes, const std::string& name);

/// IoError where it cannot be written: it appears under its name only when it is whole.
void write_images(const std::string& path, const std::vector<ObjectImages>& objects);
/// IoError where it cannot be read.
std::vector<ObjectImages> read_images(const std::string& path);

}  // namespace dapple::depthimage
