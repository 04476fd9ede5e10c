// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/gltf_check.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace dapple::modelfile {

namespace {

using nlohmann::json;
using std::to_string;

struct Damage : std::runtime_error {
  Damage(const std::string& where, const std::string& what) : std::runtime_error(where + ": " + what) {}
};

std::string shown(const json& value) {
  if (value.is_structured()) return value.is_array() ? "a list" : "an object";
  const std::string text = value.dump();
  size_t longest = 40;
  if (text.size() <= longest) return text;
  while ((text[longest] & 0xc0) == 0x80) --longest;  // within a character of UTF-8
  return text.substr(0, longest) + "...";
}

constexpr size_t byte = 5120, unsigned_byte = 5121, short_ = 5122, unsigned_short = 5123, unsigned_int = 5125,
                 float_ = 5126;

size_t bytes_of(size_t component) {
  return component == byte || component == unsigned_byte      ? 1
         : component == short_ || component == unsigned_short ? 2
                                                              : 4;
}

// What an accessor is used for; empty lists: any.
struct Use {
  std::vector<std::string> types;
  std::vector<size_t> components;
};

class Checker {
 public:
  Checker(const json& file, std::optional<size_t> binary) : file_(file), binary_(binary) {}

  void check() const {
    if (file_.contains("meshes") && file_.at("meshes").is_object()) return;  // glTF 1.0
    each(file_, "images", "image", [&](const json& image, const std::string& at) {
      if (image.contains("bufferView")) view(image, at);
    });
    each(file_, "meshes", "mesh", [&](const json& mesh, const std::string& at) {
      required_list(mesh, "primitives", at);
      each(mesh, "primitives", at + ", primitive",
           [&](const json& p, const std::string& of_primitive) { check_primitive(p, of_primitive); });
    });
    each(file_, "skins", "skin", [&](const json& s, const std::string& at) { check_skin(s, at); });
    each(file_, "nodes", "node", [&](const json& n, const std::string& at) { check_node(n, at); });
    each(file_, "animations", "animation", [&](const json& a, const std::string& at) { check_animation(a, at); });
  }

 private:
  static constexpr size_t most = size_t(1) << 53;

  static const json& list(const json& of, const char* name, const std::string& where) {
    static const json none = json::array();
    const auto found = of.find(name);
    if (found == of.end()) return none;
    if (!found->is_array()) throw Damage(where, std::string(name) + " is " + shown(*found) + ", no list");
    return *found;
  }

  // Calls visit(element, where) for those of a list, if there is one.
  template <class Visit>
  void each(const json& of, const char* name, const std::string& where, const Visit& visit) const {
    size_t i = 0;
    for (const json& element : list(of, name, where)) {
      const std::string at = where + " " + to_string(i++);
      if (!element.is_object()) throw Damage(at, "is " + shown(element) + ", no object");
      visit(element, at);
    }
  }

  static const json& member(const json& of, const char* name, const std::string& where) {
    const auto found = of.find(name);
    if (found == of.end()) throw Damage(where, std::string(name) + " is missing");
    return *found;
  }

  static const json& required_list(const json& of, const char* name, const std::string& where) {
    member(of, name, where);
    return list(of, name, where);
  }

  static size_t whole(const json& number, const std::string& name, size_t least, const std::string& where) {
    if (!number.is_number_unsigned() || number.get<size_t>() < least || number.get<size_t>() > most)
      throw Damage(where, name + " is " + shown(number) + ", no whole number from " + to_string(least) + " on");
    return number.get<size_t>();
  }
  static size_t whole_in(const json& of, const char* name, size_t least, const std::string& where) {
    return whole(member(of, name, where), name, least, where);
  }
  static size_t whole_or(const json& of, const char* name, size_t fallback, const std::string& where) {
    return of.contains(name) ? whole_in(of, name, 0, where) : fallback;
  }

  size_t index(const json& number, const std::string& name, const char* of, const std::string& where) const {
    const size_t i = whole(number, name, 0, where), n = list(file_, of, where).size();
    if (i >= n) throw Damage(where, name + " is " + to_string(i) + ", of " + to_string(n) + " " + of);
    return i;
  }
  void index_if_any(const json& of, const char* name, const char* in, const std::string& where) const {
    if (of.contains(name)) index(of.at(name), name, in, where);
  }

  size_t bytes_of_buffer(size_t i, const std::string& where) const {
    const json& buffer = file_.at("buffers").at(i);
    const size_t size = whole_in(buffer, "byteLength", 1, where);
    if (i == 0 && binary_ && !buffer.contains("uri") && size > *binary_)
      throw Damage(where, "byteLength is " + to_string(size) + ", of " + to_string(*binary_) + " bytes in the file");
    return size;
  }

  struct View {
    std::string where;
    size_t size = 0, stride = 0;  // bytes
  };

  View view(const json& of, const std::string& where) const {
    const size_t i = index(member(of, "bufferView", where), "bufferView", "bufferViews", where);
    const json& in_file = file_.at("bufferViews").at(i);
    View out{where + ", bufferView " + to_string(i), 0, 0};
    const size_t buffer = index(member(in_file, "buffer", out.where), "buffer", "buffers", out.where);
    const std::string of_buffer = ", buffer " + to_string(buffer);
    const size_t begin = whole_or(in_file, "byteOffset", 0, out.where);
    out.size = whole_in(in_file, "byteLength", 1, out.where);
    out.stride = whole_or(in_file, "byteStride", 0, out.where);
    if (begin + out.size > bytes_of_buffer(buffer, out.where + of_buffer))
      throw Damage(out.where + of_buffer, "ends before the view");
    return out;
  }

  // Elements of an accessor, or of a part of a sparse one.
  void check_range(const json& of, size_t count, size_t size, const std::string& where) const {
    const View v = view(of, where);
    const size_t begin = whole_or(of, "byteOffset", 0, where), stride = v.stride == 0 ? size : v.stride;
    if (stride < size)
      throw Damage(v.where, "byteStride is " + to_string(stride) + ", of elements of " + to_string(size) + " bytes");
    if (double(begin) + double(count - 1) * double(stride) + double(size) > double(v.size))
      throw Damage(v.where, "ends before the elements");
  }

  static size_t component_of(const json& of, std::vector<size_t> known, const std::string& where) {
    const size_t component = whole_in(of, "componentType", 0, where);
    if (std::find(known.begin(), known.end(), component) == known.end())
      throw Damage(where, "componentType is " + to_string(component) + ", which glTF does not have there");
    return component;
  }

  // Its count.
  size_t accessor(const json& number, const std::string& name, const Use& use, std::string where) const {
    const size_t i = index(number, name, "accessors", where);
    where += ", " + name + ", accessor " + to_string(i);
    const json& a = file_.at("accessors").at(i);
    static const std::map<std::string, size_t> widths = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                         {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
    const size_t component =
        component_of(a, {byte, unsigned_byte, short_, unsigned_short, unsigned_int, float_}, where);
    const size_t count = whole_in(a, "count", 1, where);
    const json& type = member(a, "type", where);
    const auto width = type.is_string() ? widths.find(type.get<std::string>()) : widths.end();
    const auto is_of = [](const auto& all, const auto& v) {
      return all.empty() || std::find(all.begin(), all.end(), v) != all.end();
    };
    if (width == widths.end() || !is_of(use.types, width->first))
      throw Damage(where, "type is " + shown(type) + ", which glTF does not have there");
    if (!is_of(use.components, component)) component_of(a, use.components, where);
    if (a.contains("normalized") && !a.at("normalized").is_boolean())
      throw Damage(where, "normalized is " + shown(a.at("normalized")) + ", neither true nor false");
    const size_t size = bytes_of(component) * width->second;
    whole_or(a, "byteOffset", 0, where);
    if (a.contains("bufferView")) check_range(a, count, size, where);
    if (a.contains("sparse")) check_sparse(a.at("sparse"), count, size, where + ", sparse");
    return count;
  }

  static void check_is_object(const json& value, const std::string& where) {
    if (!value.is_object()) throw Damage(where, "is " + shown(value) + ", no object");
  }

  void check_sparse(const json& sparse, size_t of, size_t size, const std::string& where) const {
    check_is_object(sparse, where);
    const size_t count = whole_in(sparse, "count", 1, where);
    if (count > of) throw Damage(where, "count is " + to_string(count) + ", of " + to_string(of));
    const json &indices = member(sparse, "indices", where), &values = member(sparse, "values", where);
    check_range(indices, count,
                bytes_of(component_of(indices, {unsigned_byte, unsigned_short, unsigned_int}, where + ", indices")),
                where + ", indices");
    check_range(values, count, size, where + ", values");
  }

  // Nothing of attributes that Assimp does not read.
  static const Use* use_of(const std::string& attribute, bool in_target) {
    static const std::map<std::string, Use> uses = {
        {"POSITION", {{"VEC3"}, {}}},
        {"NORMAL", {{"VEC3"}, {}}},
        {"TANGENT", {{"VEC4"}, {}}},
        {"TEXCOORD", {{"VEC2"}, {}}},
        {"COLOR", {{"VEC3", "VEC4"}, {unsigned_byte, unsigned_short, float_}}},
        {"JOINTS", {{"VEC4"}, {unsigned_byte, unsigned_short}}},
        {"WEIGHTS", {{"VEC4"}, {}}}};
    static const Use of_moved_tangents{{"VEC3"}, {}}, of_moved_colors{{"VEC3", "VEC4"}, {}};
    if (in_target && attribute == "TANGENT") return &of_moved_tangents;
    if (in_target && attribute.starts_with("COLOR")) return &of_moved_colors;
    const auto found =
        std::find_if(uses.begin(), uses.end(), [&](const auto& u) { return attribute.starts_with(u.first); });
    return found == uses.end() ? nullptr : &found->second;
  }

  void check_attributes(const json& attributes, bool in_target, const std::string& where,
                        std::optional<size_t>* vertices) const {
    check_is_object(attributes, where);
    for (const auto& [name, number] : attributes.items()) {
      const Use* const use = use_of(name, in_target);
      if (!use) continue;
      const size_t count = accessor(number, name, *use, where);
      if (count != vertices->value_or(count))
        throw Damage(where + ", " + name, "count is " + to_string(count) + ", others' is " + to_string(**vertices));
      *vertices = count;
    }
  }

  void check_primitive(const json& primitive, const std::string& where) const {
    constexpr size_t triangles = 4, fan = 6;
    if (const size_t mode = whole_or(primitive, "mode", triangles, where); mode > fan)
      throw Damage(where, "mode is " + to_string(mode) + ", which glTF does not have");
    index_if_any(primitive, "material", "materials", where);
    std::optional<size_t> vertices;
    check_attributes(member(primitive, "attributes", where), false, where, &vertices);
    if (primitive.contains("indices"))
      accessor(primitive.at("indices"), "indices", {{"SCALAR"}, {unsigned_byte, unsigned_short, unsigned_int}}, where);
    size_t i = 0;
    for (const json& target : list(primitive, "targets", where))
      check_attributes(target, true, where + ", target " + to_string(i++), &vertices);
  }

  void check_skin(const json& skin, const std::string& where) const {
    const json& joints = required_list(skin, "joints", where);
    if (joints.empty()) throw Damage(where, "joints is an empty list");
    for (const json& joint : joints) index(joint, "joint", "nodes", where);
    if (!skin.contains("inverseBindMatrices")) return;
    const size_t count = accessor(skin.at("inverseBindMatrices"), "inverseBindMatrices", {{"MAT4"}, {float_}}, where);
    if (count < joints.size())
      throw Damage(where + ", inverseBindMatrices",
                   "count is " + to_string(count) + ", of " + to_string(joints.size()) + " joints");
  }

  void check_node(const json& node, const std::string& where) const {
    index_if_any(node, "mesh", "meshes", where);
    index_if_any(node, "skin", "skins", where);
    index_if_any(node, "camera", "cameras", where);
    for (const json& child : list(node, "children", where)) index(child, "child", "nodes", where);
  }

  void check_animation(const json& animation, const std::string& where) const {
    struct Sampler {
      size_t keys, values;
      const json* output;
    };
    std::vector<Sampler> samplers;
    each(animation, "samplers", where + ", sampler", [&](const json& sampler, const std::string& at) {
      const auto interpolation = sampler.find("interpolation");
      const bool is_given = interpolation != sampler.end(), is_cubic = is_given && *interpolation == "CUBICSPLINE";
      if (is_given && !is_cubic && *interpolation != "LINEAR" && *interpolation != "STEP")
        throw Damage(at, "interpolation is " + shown(*interpolation) + ", which glTF does not have");
      const size_t keys = accessor(member(sampler, "input", at), "input", {{"SCALAR"}, {float_}}, at);
      const json& output = member(sampler, "output", at);
      accessor(output, "output", {}, at);
      samplers.push_back({keys, is_cubic ? 3 * keys : keys, &output});
    });
    each(animation, "channels", where + ", channel", [&](const json& channel, const std::string& at) {
      const size_t i = whole_in(channel, "sampler", 0, at);
      if (i >= samplers.size()) throw Damage(at, "sampler is " + to_string(i) + ", of " + to_string(samplers.size()));
      const json& target = member(channel, "target", at);
      check_is_object(target, at + ", target");
      index_if_any(target, "node", "nodes", at);
      static const std::map<std::string, Use> uses = {{"translation", {{"VEC3"}, {}}},
                                                      {"rotation", {{"VEC4"}, {}}},
                                                      {"scale", {{"VEC3"}, {}}},
                                                      {"weights", {{"SCALAR"}, {}}}};
      const json& path = member(target, "path", at);
      const auto use = path.is_string() ? uses.find(path.get<std::string>()) : uses.end();
      if (path == "pointer") return;  // of KHR_animation_pointer
      if (use == uses.end()) throw Damage(at, "path is " + shown(path) + ", which glTF does not have");
      const size_t count = accessor(*samplers[i].output, "output", use->second, at);
      const bool is_right = use->first == "weights" ? count % samplers[i].values == 0 : count >= samplers[i].values;
      if (!is_right)
        throw Damage(at + ", output",
                     "count is " + to_string(count) + ", for " + to_string(samplers[i].keys) + " times");
    });
  }

  const json& file_;
  const std::optional<size_t> binary_;
};

}  // namespace

std::string gltf_damage(const json& file, std::optional<size_t> binary) {
  try {
    Checker(file, binary).check();
  } catch (const Damage& damage) {
    return damage.what();
  }
  return {};
}

}  // namespace dapple::modelfile
