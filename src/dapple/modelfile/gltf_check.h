// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace dapple::modelfile {

/// Where numbers of a glTF 2.0 file are not what its specification has, so that Assimp would take defaults without a
/// word or read beyond their end: accessors of primitives, skins and animations (section 5.1), buffer views and
/// buffers of these and of images (5.10, 5.11), and what names meshes, joints and the like. "mesh 0, primitive 0,
/// POSITION, accessor 3: type is missing"; empty: nowhere. What is not read is not judged, nor a byteStride that is no
/// multiple of 4, which can be read; files of glTF 1.0, whose lists are objects, have none of this. `binary`: bytes of
/// a .glb file's buffer.
std::string gltf_damage(const nlohmann::json& file, std::optional<size_t> binary);

}  // namespace dapple::modelfile
