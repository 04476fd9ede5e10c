// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_attributes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <stdexcept>
#include <vector>

#include "dapple/modelfile/gltf_check.h"

namespace dapple::modelfile {

namespace {

using nlohmann::json;

constexpr char base64_digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string to_base64(const std::string& bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t v = 0;
    for (size_t k = 0; k < 3; ++k) v = v << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : base64_digits[v >> (18 - 6 * k) & 63];
  }
  return out;
}

std::string from_base64(const std::string& text, size_t begin) {
  std::array<int8_t, 256> value;
  value.fill(-1);
  for (int8_t i = 0; i < 64; ++i) value[uint8_t(base64_digits[i])] = i;
  std::string out;
  uint32_t bits = 0;
  int count = 0;
  for (size_t i = begin; i < text.size(); ++i) {
    const int8_t v = value[uint8_t(text[i])];
    if (v < 0) break;
    bits = bits << 6 | uint32_t(v);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out += char(bits >> count & 255);
  }
  return out;
}

uint32_t word_at(const std::string& bytes, size_t at) {
  uint32_t word = 0;
  if (at + sizeof word > bytes.size()) throw std::out_of_range("glb");
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

void append_word(std::string* bytes, uint32_t word) {
  bytes->append(reinterpret_cast<const char*>(&word), sizeof word);
}

// A .gltf file, or the two chunks of a .glb file.
struct Container {
  static constexpr uint32_t magic = 0x46546c67, json_chunk = 0x4e4f534a;

  explicit Container(const std::string& file) : is_binary(file.size() >= 20 && word_at(file, 0) == magic) {
    if (!is_binary) {
      text = file;
      return;
    }
    const size_t length = word_at(file, 12);
    if (word_at(file, 16) != json_chunk || length > file.size() - 20) throw std::out_of_range("glb");
    text = file.substr(20, length);
    rest = file.substr(20 + length);
    if (rest.size() >= 8) binary = rest.substr(8, word_at(rest, 0));
  }

  std::string with(std::string changed) const {
    if (!is_binary) return changed;
    changed.resize((changed.size() + 3) / 4 * 4, ' ');
    if (20 + changed.size() + rest.size() > UINT32_MAX) throw std::out_of_range("glb");
    std::string out;
    for (const size_t word :
         {size_t(magic), size_t(2), 20 + changed.size() + rest.size(), changed.size(), size_t(json_chunk)})
      append_word(&out, uint32_t(word));
    return out + changed + rest;
  }

  bool is_binary;
  std::string text, rest, binary;
};

size_t whole(const json& number) {
  if (!number.is_number_unsigned()) throw std::out_of_range("number");
  return number.get<size_t>();
}

size_t whole_or_0(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? 0 : whole(*found);
}

// What does not fit throws: json's own exceptions, or std::out_of_range.
class Attributes {
 public:
  Attributes(json* file, const std::string& binary, const std::function<std::string(const std::string&)>& read)
      : file_(*file), binary_(binary), read_(read) {}

  /// False where nothing was to be done, or is damaged.
  bool convert() {
    std::set<size_t> found;
    find_in_meshes(&found);
    find_in_animations(&found);
    std::erase_if(found,
                  [&](size_t i) { return is_float(i) || !is_whole([&] { convert(&file_.at("accessors").at(i)); }); });
    add_bind_matrices();
    if (floats_.empty()) return false;
    file_["buffers"].push_back(
        {{"byteLength", floats_.size()}, {"uri", "data:application/octet-stream;base64," + to_base64(floats_)}});
    return true;
  }

  /// Triangles with indices of vertices that are not there.
  size_t lost_faces() {
    size_t lost = 0;
    for_each_primitive([&](const json& primitive) { lost += lost_faces_of(primitive); });
    buffers_.clear();  // most files need them for nothing else
    return lost;
  }

 private:
  static constexpr int float_type = 5126;

  // Of one part of the file, which others do not need: false where it is damaged.
  template <class Do>
  static bool is_whole(const Do& use) {
    try {
      use();
      return true;
    } catch (const json::exception&) {
    } catch (const std::out_of_range&) {
    }
    return false;
  }

  template <class Visit>
  void for_each_primitive(const Visit& visit) const {
    const auto is_compressed = [](const json& primitive) {
      return primitive.value("extensions", json::object()).contains("KHR_draco_mesh_compression");
    };
    for (const json& mesh : file_.value("meshes", json::array()))
      is_whole([&] {
        for (const json& primitive : mesh.at("primitives"))
          is_whole([&] {
            if (!is_compressed(primitive)) visit(primitive);
          });
      });
  }

  static constexpr size_t triangles = 4, fan = 6;  // modes; 5: a strip

  size_t lost_faces_of(const json& primitive) {
    const size_t mode = primitive.contains("mode") ? whole(primitive.at("mode")) : triangles;
    if (!primitive.contains("indices") || mode < triangles || mode > fan) return 0;
    const size_t indices = whole(primitive.at("indices"));
    const size_t vertices =
        whole(file_.at("accessors").at(whole(primitive.at("attributes").at("POSITION"))).at("count"));
    const auto [known, is_new] = lost_faces_.try_emplace({indices, vertices, mode}, 0);
    if (is_new) known->second = count_lost_faces(file_.at("accessors").at(indices), double(vertices), mode);
    return known->second;
  }

  size_t count_lost_faces(const json& indices, double vertices, size_t mode) {
    if (!indices.contains("bufferView") || indices.contains("sparse")) return 0;
    const size_t count = whole(indices.at("count"));
    size_t lost = 0, n = 0;
    bool first = true;
    std::array<bool, 3> is_lost{};  // of the last three indices
    const auto add = [&](double index) {
      is_lost[n++ % 3] = !(index < vertices);
      first = n == 1 ? is_lost[0] : first;
      if (n < 3 || (mode == triangles && n % 3 != 0)) return;
      lost +=
          mode == fan ? first || is_lost[(n - 1) % 3] || is_lost[(n - 2) % 3] : is_lost[0] || is_lost[1] || is_lost[2];
    };
    visit_numbers(whole(indices.at("bufferView")), whole_or_0(indices, "byteOffset"), type_of(indices), count, 1, add);
    return lost;
  }

  static bool is_float_for_assimp(const std::string& name) {
    return name == "POSITION" || name == "NORMAL" || name == "TANGENT" || name.starts_with("TEXCOORD_") ||
           name.starts_with("WEIGHTS_");
  }

  void find_in_meshes(std::set<size_t>* found) const {
    const auto add = [&](const json& attributes) {
      for (const auto& [name, accessor] : attributes.items())
        if (is_float_for_assimp(name)) is_whole([&] { found->insert(whole(accessor)); });
    };
    for_each_primitive([&](const json& primitive) {
      add(primitive.at("attributes"));
      for (const json& target : primitive.value("targets", json::array())) add(target);
    });
  }

  void find_in_animations(std::set<size_t>* found) const {
    for (const json& animation : file_.value("animations", json::array()))
      is_whole([&] {
        for (const json& sampler : animation.at("samplers"))
          is_whole([&] { found->insert(whole(sampler.at("output"))); });
      });
  }

  static size_t width_of(const json& accessor) {
    static const std::map<std::string, size_t> widths = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    return widths.at(accessor.at("type").get<std::string>());
  }

  static int type_of(const json& accessor) {
    const size_t type = whole(accessor.at("componentType"));
    if (type > size_t(float_type)) throw std::out_of_range("component type");
    return int(type);
  }

  static size_t size_of(int type) {
    switch (type) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
        return 4;
      default:
        throw std::out_of_range("component type");
    }
  }

  static double number_at(const char* at, int type) {
    const auto as = [&](auto v) {
      std::memcpy(&v, at, sizeof v);
      return double(v);
    };
    switch (type) {
      case 5120:
        return as(int8_t());
      case 5121:
        return as(uint8_t());
      case 5122:
        return as(int16_t());
      case 5123:
        return as(uint16_t());
      default:
        return as(uint32_t());
    }
  }

  // glTF 2.0, section 3.6.2.2.
  static double normalized(double v, int type) {
    static const std::map<int, double> largest = {{5120, 127}, {5121, 255}, {5122, 32767}, {5123, 65535}};
    return std::max(v / largest.at(type), -1.0);
  }

  const std::string& buffer(size_t i) {
    const auto [at, is_new] = buffers_.try_emplace(i);
    if (!is_new) return at->second;
    const std::string uri = file_.at("buffers").at(i).value("uri", std::string());
    const size_t comma = uri.find(',');
    if (uri.empty() && i > 0) throw std::out_of_range("buffer");  // of an extension
    if (uri.empty())
      at->second = binary_;
    else if (uri.starts_with("data:"))
      at->second = comma == uri.npos ? "" : from_base64(uri, comma + 1);
    else
      at->second = read_(uri);
    return at->second;
  }

  // Calls visit(number) for `count` times `width` numbers of a buffer view, from `offset` on.
  template <class Visit>
  void visit_numbers(size_t view_index, size_t offset, int type, size_t count, size_t width, const Visit& visit) {
    const json& view = file_.at("bufferViews").at(view_index);
    const std::string& bytes = buffer(whole(view.at("buffer")));
    const size_t begin = whole_or_0(view, "byteOffset") + offset, size = size_of(type);
    const size_t stride = std::max(whole_or_0(view, "byteStride"), size * width);
    if (begin > bytes.size() || (count > 0 && (bytes.size() - begin) / stride + 1 < count) ||
        (count > 0 && begin + (count - 1) * stride + size * width > bytes.size()))
      throw std::out_of_range("buffer view");
    for (size_t i = 0; i < count; ++i)
      for (size_t k = 0; k < width; ++k) visit(number_at(bytes.data() + begin + i * stride + k * size, type));
  }

  std::vector<double> numbers(size_t view_index, size_t offset, int type, size_t count, size_t width) {
    std::vector<double> out;
    visit_numbers(view_index, offset, type, count, width, [&out](double v) { out.push_back(v); });
    return out;
  }

  bool is_float(size_t accessor) const {
    bool is = false;
    is_whole([&] { is = file_.at("accessors").at(accessor).at("componentType") == float_type; });
    return is;
  }

  void convert(json* accessor) {
    const int type = type_of(*accessor);
    const size_t count = whole(accessor->at("count")), width = width_of(*accessor);
    std::vector<double> values;
    if (accessor->contains("bufferView"))
      values = numbers(whole(accessor->at("bufferView")), whole_or_0(*accessor, "byteOffset"), type, count, width);
    else if (count <= size_t(1) << 28)
      values.assign(count * width, 0);
    else
      throw std::out_of_range("count");
    if (accessor->contains("sparse")) replace(accessor->at("sparse"), type, width, &values);
    const bool is_normalized = accessor->value("normalized", false);
    const size_t begin = floats_.size();
    for (const double v : values) {
      const float f = float(is_normalized ? normalized(v, type) : v);
      floats_.append(reinterpret_cast<const char*>(&f), sizeof f);
    }
    for (const char* name : {"sparse", "normalized", "byteOffset", "min", "max"}) accessor->erase(name);
    (*accessor)["componentType"] = float_type;
    (*accessor)["bufferView"] = file_.at("bufferViews").size();
    add_view(begin);
  }

  // Of the floats from there on.
  void add_view(size_t begin) {
    file_["bufferViews"].push_back(
        {{"buffer", file_.at("buffers").size()}, {"byteOffset", begin}, {"byteLength", floats_.size() - begin}});
  }

  // Those of identity, which a skin need not have, and Assimp reads all the same.
  void add_bind_matrices() {
    if (!file_.contains("skins")) return;
    for (json& skin : file_.at("skins"))
      is_whole([&] {
        if (skin.contains("inverseBindMatrices")) return;
        const size_t joints = skin.at("joints").size(), begin = floats_.size();
        for (size_t i = 0; i < joints * 16; ++i) {
          const float f = i % 16 % 5 == 0 ? 1 : 0;
          floats_.append(reinterpret_cast<const char*>(&f), sizeof f);
        }
        skin["inverseBindMatrices"] = file_.at("accessors").size();
        file_["accessors"].push_back({{"bufferView", file_.at("bufferViews").size()},
                                      {"componentType", float_type},
                                      {"type", "MAT4"},
                                      {"count", joints}});
        add_view(begin);
      });
  }

  void replace(const json& sparse, int type, size_t width, std::vector<double>* values) {
    const size_t count = whole(sparse.at("count"));
    const json &at = sparse.at("indices"), &by = sparse.at("values");
    const auto of = [&](const json& part, int component, size_t n) {
      return numbers(whole(part.at("bufferView")), whole_or_0(part, "byteOffset"), component, count, n);
    };
    const int index_type = type_of(at);
    if (index_type != 5121 && index_type != 5123 && index_type != 5125) throw std::out_of_range("sparse indices");
    const std::vector<double> indices = of(at, index_type, 1), given = of(by, type, width);
    for (size_t i = 0; i < count; ++i)
      for (size_t k = 0; k < width; ++k) values->at(size_t(indices[i]) * width + k) = given[i * width + k];
  }

  json& file_;
  const std::string& binary_;
  const std::function<std::string(const std::string&)>& read_;
  std::map<size_t, std::string> buffers_;
  std::map<std::array<size_t, 3>, size_t> lost_faces_;  // by accessor, number of vertices and mode
  std::string floats_;
};

}  // namespace

GltfRepair repair_gltf(const std::string& file, const std::function<std::string(const std::string& uri)>& read) {
  GltfRepair repair;
  try {
    const Container container(file);
    json content = json::parse(container.text);
    repair.damage = gltf_damage(content, container.is_binary ? std::optional(container.binary.size()) : std::nullopt);
    Attributes attributes(&content, container.binary, read);
    repair.lost_faces = attributes.lost_faces();
    if (attributes.convert()) repair.file = container.with(content.dump());
  } catch (const json::exception&) {
  } catch (const std::out_of_range&) {
  } catch (const std::bad_alloc&) {
  }
  return repair;
}

}  // namespace dapple::modelfile
