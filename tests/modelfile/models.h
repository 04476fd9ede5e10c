// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "dapple/modelfile/model_reader.h"
#include "dapple/modelfile/scene_reader.h"
#include "tests/scenefile/support.h"

namespace dapple::modelfile::test {

using scenefile::test::error_of;
using scenefile::test::TempFolder;

inline std::string base64(const std::string& bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t v = 0;
    for (size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : digits[v >> (18 - 6 * k) & 63];
  }
  return out;
}

/// The buffer of triangle_gltf().
inline std::string triangle_bytes() {
  std::string bytes;
  const auto add = [&](auto v) { bytes.append(reinterpret_cast<const char*>(&v), sizeof v); };
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) add(float(x));
  for (const uint16_t i : {0, 1, 2, 0}) add(i);
  for (const float x : {0, 1, 0, 0, 0, 4, 0, 0}) add(float(x));
  return bytes;
}

/// A glTF file of one triangle, (0 0 0) (1 0 0) (0 1 0), as mesh 0 and (with a second material) as mesh 1. The rest of
/// the file is `more`: scenes, nodes, materials ... Times 0 and 1 s are accessor 2, moves by 0 and (4, 0, 0)
/// accessor 3.
inline std::string triangle_gltf(const std::string& more) {
  const std::string bytes = triangle_bytes();
  return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(bytes.size()) +
         R"(,"uri":"data:application/octet-stream;base64,)" + base64(bytes) + R"("}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},
{"buffer":0,"byteOffset":44,"byteLength":8},{"buffer":0,"byteOffset":52,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
{"bufferView":2,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]},
{"bufferView":3,"componentType":5126,"count":2,"type":"VEC3"}],
"meshes":[{"name":"tri","primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]},
{"name":"lamp","primitives":[{"attributes":{"POSITION":0},"indices":1,"material":1}]}],)" +
         more + "}";
}

/// The same as a .glb file, from what triangle_gltf() returned.
inline std::string as_glb(std::string text) {
  const size_t uri = text.find(",\"uri\":");
  text.erase(uri, text.find('}', uri) - uri);
  while (text.size() % 4 != 0) text += ' ';
  const std::string bytes = triangle_bytes();
  std::string out = "glTF";
  const auto add = [&](uint32_t v) { out.append(reinterpret_cast<const char*>(&v), sizeof v); };
  add(2), add(uint32_t(28 + text.size() + bytes.size()));
  add(uint32_t(text.size())), add(0x4e4f534a);
  out += text;
  add(uint32_t(bytes.size())), add(0x004e4942);
  return out + bytes;
}

/// The buffer of a glTF file, whose arrays get accessors 0, 1, ... in the order in which they are added.
class GltfArrays {
 public:
  void floats(const std::string& type, const std::vector<float>& values) {
    static constexpr std::pair<const char*, size_t> components[] = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    size_t each = 1;
    for (const auto& [name, n] : components) each = type == name ? n : each;
    std::string bounds;  // of times and of positions, which need them
    if (each == 1 || each == 3) {
      std::vector<float> low(each, 1e30f), high(each, -1e30f);
      for (size_t i = 0; i < values.size(); ++i)
        low[i % each] = std::min(low[i % each], values[i]), high[i % each] = std::max(high[i % each], values[i]);
      bounds = ",\"min\":" + list(low) + ",\"max\":" + list(high);
    }
    add(values.data(), values.size() * sizeof(float), 5126, type, values.size() / each, bounds);
  }
  void shorts(const std::string& type, const std::vector<uint16_t>& values) {
    add(values.data(), values.size() * sizeof(uint16_t), 5123, type, values.size() / (type == "VEC4" ? 4 : 1), "");
  }
  /// A file of these, and of `more`.
  std::string file(const std::string& more) const {
    return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(bytes_.size()) +
           R"(,"uri":"data:application/octet-stream;base64,)" + base64(bytes_) + R"("}],"bufferViews":[)" + views_ +
           "],\"accessors\":[" + accessors_ + "]," + more + "}";
  }

 private:
  static std::string list(const std::vector<float>& values) {
    std::string out = "[";
    for (const float v : values) out += (out.size() > 1 ? "," : "") + std::to_string(v);
    return out + "]";
  }
  void add(const void* data, size_t size, int component, const std::string& type, size_t count,
           const std::string& bounds) {
    const std::string comma = count_ > 0 ? "," : "";
    views_ += comma + R"({"buffer":0,"byteOffset":)" + std::to_string(bytes_.size()) + R"(,"byteLength":)" +
              std::to_string(size) + "}";
    accessors_ += comma + R"({"bufferView":)" + std::to_string(count_++) + R"(,"componentType":)" +
                  std::to_string(component) + R"(,"count":)" + std::to_string(count) + R"(,"type":")" + type + "\"" +
                  bounds + "}";
    bytes_.append(static_cast<const char*>(data), size);
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
  }

  std::string bytes_, views_, accessors_;
  size_t count_ = 0;
};

inline scenefile::SceneDescription read(const std::string& path, const ModelOptions& options = {},
                                        Diagnostics* diagnostics = nullptr) {
  set_log_level(0);
  Diagnostics own;
  return read_scene(path, options, diagnostics ? *diagnostics : own);
}

}  // namespace dapple::modelfile::test
