// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_importer.h"

#include <filesystem>
#include <fstream>
#include <map>

#include "dapple/base/hash.h"
#include "dapple/modelfile/model_lights.h"
#include "dapple/modelfile/model_materials.h"
#include "dapple/modelfile/model_pictures.h"
#include "dapple/modelfile/param_list.h"
#include "dapple/scenefile/file_source.h"

namespace dapple::modelfile {

using scenefile::DescriptionBuilder;
using scenefile::ParamType;
using scenefile::SceneDescription;

namespace {

// What shines is not instanced: area lights do not work in object definitions. Beyond this it is, and does not shine.
constexpr size_t most_shining_copies = 64;

template <class V>
std::vector<float> flat(const std::vector<V>& list) {
  std::vector<float> out;
  out.reserve(list.size() * V::dimensions());
  for (const V& v : list)
    for (unsigned k = 0; k < V::dimensions(); ++k) out.push_back(v[int(k)]);
  return out;
}

// A corner of its own for each corner of a triangle.
void split_corners(ModelMesh* mesh) {
  ModelMesh out = *mesh;
  const auto pick = [&](auto& to, const auto& from) {
    to.clear();
    if (from.empty()) return;
    for (const int32_t i : mesh->indices) to.push_back(from[size_t(i)]);
  };
  pick(out.P, mesh->P), pick(out.P_end, mesh->P_end), pick(out.N, mesh->N);
  for (auto& uv : out.uv) uv.clear();
  out.uv[0] = ModelPictures::corner_places(mesh->indices.size() / 3);
  out.color.clear();
  for (size_t i = 0; i < out.indices.size(); ++i) out.indices[i] = int32_t(i);
  *mesh = std::move(out);
}

class Emitter {
 public:
  Emitter(Model&& model, const std::string& file, const std::string& prefix, const FileLoc& loc,
          SceneDescription* description, DescriptionBuilder* builder, Diagnostics* diagnostics)
      : model_(std::move(model)),
        prefix_(prefix),
        loc_(loc),
        description_(*description),
        builder_(*builder),
        diagnostics_(*diagnostics),
        pictures_(model_, file, loc, diagnostics),
        materials_(model_, prefix, loc, description, builder, &pictures_, diagnostics) {}

  Emitted emit() {
    for (const std::string& what : model_.left_out) diagnostics_.warn(loc_, what + ": left out");
    count_uses();
    for (const ModelNode& node : model_.nodes) place(node);
    if (!model_.lights.empty() && builder_.in_object())
      diagnostics_.warn(loc_, "the lights of a model inside of an object definition are left out");
    else
      emitted_.lights = emit_lights(model_, loc_, &builder_);
    if (pictures_.folder()) keep(pictures_.folder());
    return emitted_;
  }

 private:
  bool shines(uint32_t mesh) const {
    const ModelMaterial& m = model_.materials[model_.meshes[mesh].material];
    return (m.emission * std::max(m.emission_strength, 0.0f)).max() > 0;
  }

  // Nodes that hold the same meshes are instances of one object.
  void count_uses() {
    for (const ModelNode& node : model_.nodes) ++uses_[node.meshes];
  }

  bool is_object(const ModelNode& node) const {
    const size_t n = uses_.at(node.meshes);
    if (n < 2 || builder_.in_object()) return false;
    const bool any_shines = std::any_of(node.meshes.begin(), node.meshes.end(), [&](uint32_t m) { return shines(m); });
    return !any_shines || n > most_shining_copies;
  }

  void place(const ModelNode& node) {
    const Transform start(node.start), end(node.end);
    if (!usable(start) || !usable(end)) {
      diagnostics_.warn(loc_, "a node's transform has no inverse: what is there is left out",
                        "singular node " + loc_.to_string());
      return;
    }
    if (is_object(node)) {
      const std::string& object = object_of(node);
      if (object.empty()) return;
      builder_.attribute_begin(loc_);
      transform(start, end);
      builder_.object_instance(object, loc_);
      builder_.attribute_end(loc_);
      return;
    }
    builder_.attribute_begin(loc_);
    transform(start, end);
    for (const uint32_t m : node.meshes) add_shape(m);
    builder_.attribute_end(loc_);
  }

  static bool usable(const Transform& t) {
    const M44d& m = t.matrix();
    const bool affine = m[3][0] == 0 && m[3][1] == 0 && m[3][2] == 0 && m[3][3] == 1;
    return affine && t.is_finite() && t.is_invertible() && t.inverse().is_finite();
  }

  void transform(const Transform& start, const Transform& end) {
    if (start == end) {
      if (!start.is_identity()) builder_.concat(start, loc_);
      return;
    }
    builder_.active_transform(true, false);
    builder_.concat(start, loc_);
    builder_.active_transform(false, true);
    builder_.concat(end, loc_);
    builder_.active_transform(true, true);
  }

  const std::string& object_of(const ModelNode& node) {
    const auto known = objects_.find(node.meshes);
    if (known != objects_.end()) return known->second;
    std::string name = prefix_ + readable_name(node.meshes);
    for (int i = 2; description_.named_objects.contains(name); ++i)
      name = prefix_ + readable_name(node.meshes) + "." + std::to_string(i);
    builder_.attribute_begin(loc_);
    builder_.set_transform(Transform(), loc_);
    builder_.object_begin(name, loc_);
    for (const uint32_t m : node.meshes) add_shape(m);
    builder_.object_end(loc_);
    builder_.attribute_end(loc_);
    return objects_[node.meshes] = name;
  }

  std::string readable_name(const std::vector<uint32_t>& meshes) const {
    std::string out;
    for (const char c : model_.meshes[meshes[0]].name.substr(0, 60))
      out += c >= 32 && c < 127 && c != '"' && c != '\\' ? c : '_';
    return out.empty() ? "object" : out;
  }

  void add_shape(uint32_t index) {
    ModelMesh& mesh = model_.meshes[index];
    auto look = looks_.find(index);
    if (look == looks_.end()) {
      const bool corners = materials_.wants_corner_colors(mesh);
      look = looks_.emplace(index, materials_.look(mesh, corners)).first;
      if (corners) split_corners(&mesh), look->second.uv_set = 0;
    }
    const ShapeLook& l = look->second;
    Directive d("trianglemesh", loc_);
    d.floats("P", ParamType::point3, flat(mesh.P));
    if (!mesh.P_end.empty()) d.floats("P1", ParamType::point3, flat(mesh.P_end));
    if (!mesh.N.empty()) d.floats("N", ParamType::normal, flat(mesh.N));
    if (const auto& uv = mesh.uv[l.uv_set]; !uv.empty()) d.floats("uv", ParamType::point2, flat(uv));
    d.integers("indices", mesh.indices);
    if (l.alpha) d.add(*l.alpha);
    builder_.named_material(l.material, loc_);
    builder_.area_light(l.emission && !builder_.in_object() ? *l.emission : scenefile::Entity{});
    if (l.emission && !builder_.in_object()) ++emitted_.emitters;
    builder_.shape(d.take());
    ++emitted_.shapes;
  }

  void keep(std::shared_ptr<const image::TemporaryFolder> folder) {
    using Kept = std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>>;
    description_.temporary_files = std::make_shared<const Kept>(description_.temporary_files, std::move(folder));
  }

  Model model_;
  const std::string prefix_;
  const FileLoc loc_;
  SceneDescription& description_;
  DescriptionBuilder& builder_;
  Diagnostics& diagnostics_;
  ModelPictures pictures_;
  ModelMaterials materials_;
  std::map<std::vector<uint32_t>, size_t> uses_;
  std::map<std::vector<uint32_t>, std::string> objects_;
  std::map<uint32_t, ShapeLook> looks_;
  Emitted emitted_;
};

}  // namespace

Emitted emit_model(Model model, const std::string& file, const std::string& prefix, const FileLoc& loc,
                   SceneDescription* description, DescriptionBuilder* builder, Diagnostics* diagnostics) {
  // The fingerprint is that of the model's own file; of shapes and pictures beside it the build takes one.
  description->fingerprint = hash_bytes(scenefile::FileSource(file, loc).contents(), description->fingerprint);
  return Emitter(std::move(model), file, prefix, loc, description, builder, diagnostics).emit();
}

void ModelImporter::import(const std::string& path, const FileLoc& loc, SceneDescription* description,
                           DescriptionBuilder* builder, Diagnostics* diagnostics) {
  Model model = read_model(path, {}, loc);
  description->files.push_back(path);
  const FileLoc place{description->files.back(), 0, 0};
  if (!model.cameras.empty())
    diagnostics->warn(place, "the cameras of a model that a scene imports are not used", "cameras of " + path);
  const std::string prefix = std::filesystem::path(path).filename().string() + "/";
  try {
    emit_model(std::move(model), description->files.back(), prefix, place, description, builder, diagnostics);
  } catch (const InputError& error) {
    throw InputError(error, loc);
  }
}

}  // namespace dapple::modelfile
