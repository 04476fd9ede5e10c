// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/assimp_reader.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <sys/stat.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>

#include "dapple/image/image.h"
#include "dapple/image/image_writer.h"
#include "dapple/modelfile/gltf_attributes.h"
#include "dapple/modelfile/gltf_extensions.h"
#include "dapple/modelfile/pose.h"
#include "dapple/scenefile/polygon.h"

namespace dapple::modelfile {

namespace {

// Of Wavefront's vertices: Assimp counts what begins with a digit or a sign, and refuses "v .5 1 0".
std::string with_leading_zeros(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  bool of_vertex = false;
  for (char before = '\n'; const char c : text) {
    if (before == '\n') of_vertex = c == 'v';
    if (of_vertex && c == '.' && (before == ' ' || before == '\t')) out += '0';
    out += before = c;
  }
  return out;
}

// Files beside the model: devices and pipes would hang.
class RegularFiles final : public Assimp::DefaultIOSystem {
 public:
  bool Exists(const char* file) const override { return is_regular(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (!mode || mode[0] != 'r' || !is_regular(file)) return nullptr;
    Assimp::IOStream* const stream = DefaultIOSystem::Open(file, mode);
    if (!stream) return nullptr;
    const std::string extension = image::extension_of(file);
    if (extension == "obj") return repaired_obj(stream);
    return extension == "gltf" || extension == "glb" ? repaired_gltf(stream, file) : stream;
  }
  /// GltfRepair's, of all files that were read.
  size_t lost_faces() const {
    size_t sum = 0;
    for (const auto& [file, repair] : repaired_) sum += repair.lost_faces;
    return sum;
  }
  std::string damage() const {
    for (const auto& [file, repair] : repaired_)
      if (!repair.damage.empty()) return repair.damage;
    return {};
  }

 private:
  static std::string text_of(Assimp::IOStream* stream) {
    std::string text(stream->FileSize(), '\0');
    text.resize(stream->Read(text.data(), 1, text.size()));
    return text;
  }
  static Assimp::IOStream* stream_of(const std::string& text) {
    auto* const bytes = new uint8_t[text.size()];  // which MemoryIOStream deletes
    std::copy(text.begin(), text.end(), bytes);
    return new Assimp::MemoryIOStream(bytes, text.size(), true);
  }
  static Assimp::IOStream* repaired_obj(Assimp::IOStream* stream) {
    const std::unique_ptr<Assimp::IOStream> closed_after(stream);
    return stream_of(with_leading_zeros(text_of(stream)));
  }
  // Assimp opens a file several times.
  Assimp::IOStream* repaired_gltf(Assimp::IOStream* stream, const std::string& path) {
    const auto [repaired, is_new] = repaired_.try_emplace(path);
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    const auto read = [&](const std::string& uri) {
      const std::string beside = (folder / uri).string();
      const std::unique_ptr<Assimp::IOStream> other(is_regular(beside.c_str()) ? DefaultIOSystem::Open(beside.c_str())
                                                                               : nullptr);
      return other ? text_of(other.get()) : "";
    };
    if (is_new) repaired->second = repair_gltf(text_of(stream), read);
    const GltfRepair& repair = repaired->second;
    stream->Seek(0, aiOrigin_SET);
    if (repair.file.empty() && repair.damage.empty()) return stream;
    delete stream;
    return repair.damage.empty() ? stream_of(repair.file) : nullptr;
  }
  static bool is_regular(const char* file) {
    struct stat s {};
    return file && stat(file, &s) == 0 && S_ISREG(s.st_mode);
  }

  std::map<std::string, GltfRepair> repaired_;
};

bool is_usable(const aiVector3D& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

V3f finite_or_zero(const V3f& v) {
  return is_finite(v) ? v : V3f(0, 0, 0);
}

class Converter {
 public:
  /// `lost_faces`: what the importer has left out.
  Converter(const aiScene& scene, const std::string& path, const ModelTime& time, size_t lost_faces)
      : scene_(scene),
        path_(path),
        time_(time),
        start_(scene, time.open),
        end_(scene, time.open >= 0 && time.shutter > 0 ? time.open + time.shutter : time.open),
        bad_faces_(lost_faces) {
    const std::string extension = image::extension_of(path);
    is_gltf_ = extension == "gltf" || extension == "glb";
    static const std::set<std::string> z_up = {"stl", "ply", "off", "3mf", "amf", "raw", "blend"},
                                       without_materials = {"stl", "ply", "off", "raw"};
    model_.z_up = z_up.contains(extension);
    has_materials_ = !without_materials.contains(extension);
  }

  Model convert() {
    for (unsigned i = 0; i < scene_.mNumMaterials; ++i)
      model_.materials.push_back(convert_material(*scene_.mMaterials[i], scene_, is_gltf_));
    if (is_gltf_) add_gltf_extensions(path_, &model_);
    if (model_.materials.empty()) model_.materials.emplace_back();
    convert_images();
    mesh_at_.assign(scene_.mNumMeshes, none);
    add_nodes(*scene_.mRootNode);
    transform_coordinates();
    replace_placeholders();
    show_what_is_invisible();
    convert_cameras();
    convert_lights(scene_, is_gltf_, &model_);
    place_lights();
    read_settings();
    say_what_is_left_out();
    return std::move(model_);
  }

 private:
  static constexpr uint32_t none = ~0u;

  void add_nodes(const aiNode& node) {
    ModelNode placed;
    placed.name = node.mName.C_Str();
    placed.start = to_rows(start_.global(node));
    placed.end = to_rows(end_.global(node));
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= scene_.mNumMeshes) throw std::runtime_error("a node names a mesh that there is not");
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
      if (Pose::deforms(mesh)) {
        add_deformed(mesh, node, placed);
        continue;
      }
      uint32_t& at = mesh_at_[node.mMeshes[i]];
      if (at == none) {
        at = uint32_t(model_.meshes.size());
        model_.meshes.push_back(convert_mesh(mesh));
      }
      if (!model_.meshes[at].indices.empty()) placed.meshes.push_back(at);
    }
    if (!placed.meshes.empty()) model_.nodes.push_back(std::move(placed));
    for (unsigned i = 0; i < node.mNumChildren; ++i) add_nodes(*node.mChildren[i]);
  }

  // What bones move is in the scene's space already.
  void add_deformed(const aiMesh& mesh, const aiNode& node, const ModelNode& place) {
    ModelMesh out = convert_mesh(mesh);
    if (out.indices.empty()) return;
    start_.deform(mesh, node, &out.P, &out.N);
    std::vector<V3f> ignored;
    if (time_.open >= 0 && time_.shutter > 0) end_.deform(mesh, node, &out.P_end, &ignored);
    if (out.P_end == out.P) out.P_end.clear();
    for (auto* list : {&out.P, &out.P_end, &out.N})
      for (V3f& v : *list) v = finite_or_zero(v);
    ModelNode placed = place;
    placed.meshes = {uint32_t(model_.meshes.size())};
    if (mesh.mNumBones > 0) placed.start = placed.end = M44d();
    model_.meshes.push_back(std::move(out));
    model_.nodes.push_back(std::move(placed));
  }

  ModelMesh convert_mesh(const aiMesh& mesh) {
    ModelMesh out;
    out.name = mesh.mName.C_Str();
    out.material = mesh.mMaterialIndex < model_.materials.size() ? mesh.mMaterialIndex : 0;
    const size_t n = mesh.mNumVertices;
    std::vector<bool> usable(n);
    out.P.resize(n);
    for (size_t i = 0; i < n; ++i) {
      usable[i] = is_usable(mesh.mVertices[i]);
      if (usable[i])
        out.P[i] = V3f(mesh.mVertices[i].x, mesh.mVertices[i].y, mesh.mVertices[i].z);
      else
        out.P[i] = V3f(0, 0, 0);
    }
    if (mesh.mNormals) {
      out.N.resize(n);
      for (size_t i = 0; i < n; ++i)
        out.N[i] = finite_or_zero(V3f(mesh.mNormals[i].x, mesh.mNormals[i].y, mesh.mNormals[i].z));
    }
    for (size_t set = 0; set < out.uv.size(); ++set) {
      if (!mesh.mTextureCoords[set]) continue;
      out.uv[set].resize(n);
      for (size_t i = 0; i < n; ++i) {
        const aiVector3D& t = mesh.mTextureCoords[set][i];
        out.uv[set][i] = is_usable(t) ? V2f(t.x, t.y) : V2f(0, 0);
      }
    }
    if (mesh.mColors[0]) convert_colors(mesh, &out);
    add_triangles(mesh, usable, &out);
    return out;
  }

  // glTF's; Assimp turns by the wrong middle.
  void transform_coordinates() {
    for (ModelMesh& mesh : model_.meshes) {
      const UvTransform& t = model_.materials[mesh.material].uv_transform;
      if (t == UvTransform()) continue;
      for (auto& uv : mesh.uv)
        for (V2f& p : uv) {
          const V2f moved = t(p);
          p = std::isfinite(moved.x) && std::isfinite(moved.y) ? moved : V2f(0, 0);
        }
    }
  }

  // The material that Assimp makes up where a file has none: white or grey.
  bool is_placeholder(const ModelMaterial& m) const {
    if (is_gltf_ || m.kind != ModelMaterial::phong || m.base_map.given()) return false;
    return (m.base == RGB(0.6f) && m.name == AI_DEFAULT_MATERIAL_NAME) || (m.base == RGB(1) && !has_materials_);
  }

  // Where there is no material, colours of vertices are all that there is.
  void replace_placeholders() {
    const size_t own = model_.materials.size();
    for (uint32_t i = 0; i < own; ++i) {
      if (!is_placeholder(model_.materials[i])) continue;
      model_.materials[i].base = RGB(1);
      const auto colored = [&](const ModelMesh& mesh) { return mesh.material == i && !mesh.color.empty(); };
      if (std::any_of(model_.meshes.begin(), model_.meshes.end(), colored)) {
        model_.materials.push_back(model_.materials[i]);
        for (ModelMesh& mesh : model_.meshes)
          if (colored(mesh)) mesh.material = uint32_t(model_.materials.size() - 1);
      }
      model_.materials[i].base = ModelMaterial().base;
    }
  }

  // Exporters do not agree which end of transparency is clear: a model that nobody could see means the other one.
  void show_what_is_invisible() {
    const auto hidden = [&](const ModelMesh& mesh) {
      const ModelMaterial& m = model_.materials[mesh.material];
      return m.opacity <= 0 && !m.opacity_map.given();
    };
    if (is_gltf_ || model_.meshes.empty() || !std::all_of(model_.meshes.begin(), model_.meshes.end(), hidden)) return;
    for (ModelMaterial& m : model_.materials) m.opacity = 1, m.alpha = ModelMaterial::opaque;
    model_.left_out.push_back("an opacity of 0 of all that there is");
  }

  void convert_colors(const aiMesh& mesh, ModelMesh* out) const {
    out->color.resize(mesh.mNumVertices);
    for (size_t i = 0; i < out->color.size(); ++i) {
      const aiColor4D& c = mesh.mColors[0][i];
      RGB color = to_rgb(aiColor3D(c.r, c.g, c.b));
      if (!is_gltf_)
        color = RGB(image::srgb_to_linear(color.r), image::srgb_to_linear(color.g), image::srgb_to_linear(color.b));
      out->color[i] = color;
    }
  }

  void add_triangles(const aiMesh& mesh, const std::vector<bool>& usable, ModelMesh* out) {
    std::vector<int32_t> corners;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices < 3) {
        ++thin_faces_;
        continue;
      }
      corners.clear();
      bool whole = true;
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        whole = whole && face.mIndices[k] < usable.size() && usable[face.mIndices[k]];
        corners.push_back(int32_t(face.mIndices[k]));
      }
      if (whole)
        triangulator_.add(corners, out->P, &out->indices);
      else
        ++bad_faces_;
    }
  }

  void convert_images() {
    for (unsigned i = 0; i < scene_.mNumTextures; ++i) {
      const aiTexture& t = *scene_.mTextures[i];
      ModelImage image;
      image.name = t.mFilename.C_Str();
      const auto* bytes = reinterpret_cast<const uint8_t*>(t.pcData);
      if (t.mHeight == 0) {
        image.bytes.assign(bytes, bytes + t.mWidth);
        image.extension.assign(t.achFormatHint, strnlen(t.achFormatHint, sizeof t.achFormatHint));
      } else {
        image.width = t.mWidth, image.height = t.mHeight;
        const size_t n = size_t(t.mWidth) * t.mHeight;
        image.bytes.resize(n * 4);
        for (size_t p = 0; p < n; ++p) {
          const aiTexel& texel = t.pcData[p];
          const uint8_t rgba[4] = {texel.r, texel.g, texel.b, texel.a};
          std::copy(rgba, rgba + 4, &image.bytes[p * 4]);
        }
      }
      model_.images.push_back(std::move(image));
    }
  }

  void convert_cameras() {
    for (unsigned i = 0; i < scene_.mNumCameras; ++i) {
      const aiCamera& c = *scene_.mCameras[i];
      const aiNode* const node = start_.find(c.mName.C_Str());
      ModelCamera out;
      out.name = c.mName.C_Str();
      const auto place = [&](const Pose& pose, V3d* eye, V3d* look, V3d* up) {
        const aiMatrix4x4 m = node ? pose.global(*node) : aiMatrix4x4();
        const aiMatrix3x3 linear(m);
        // Assimp 5.2 gives a camera of glTF the translation of its node a second time.
        *eye = to_v3d(m * (is_gltf_ ? aiVector3D() : c.mPosition));
        *look = *eye + to_v3d(linear * c.mLookAt).normalized();
        *up = to_v3d(linear * c.mUp).normalized();
      };
      place(start_, &out.eye, &out.look, &out.up);
      place(end_, &out.eye_end, &out.look_end, &out.up_end);
      out.fov = double(c.mHorizontalFOV) * 180 / std::numbers::pi;
      out.aspect = double(c.mAspect);
      // Of glTF's angle up the picture it makes the horizontal one by multiplying with the aspect.
      out.fov_is_vertical = is_gltf_;
      if (is_gltf_ && c.mAspect > 0) out.fov /= double(c.mAspect);
      if (c.mOrthographicWidth > 0) {
        model_.left_out.push_back("orthographic camera \"" + out.name + "\"");
        continue;
      }
      const bool is_usable = out.fov > 0 && out.fov < 179 && std::isfinite(out.aspect) &&
                             std::isfinite(out.eye.length() + out.look.length() + out.up.length()) &&
                             out.up.cross(out.look - out.eye).length() > 1e-6;
      if (is_usable) model_.cameras.push_back(std::move(out));
    }
  }

  void place_lights() {
    std::erase_if(model_.lights, [&](ModelLight& l) {
      const aiNode* const node = start_.find(l.name);
      const aiMatrix4x4 m = node ? start_.global(*node) : aiMatrix4x4();
      const aiMatrix3x3 linear(m);
      const auto turned = [&](const V3d& v) {
        return to_v3d(linear * aiVector3D(ai_real(v.x), ai_real(v.y), ai_real(v.z))).normalized();
      };
      l.position = to_v3d(m * aiVector3D(ai_real(l.position.x), ai_real(l.position.y), ai_real(l.position.z)));
      l.direction = turned(l.direction);
      l.up = turned(l.up);
      if (l.type == ModelLight::distant || l.type == ModelLight::ambient) l.position = V3d(0, 0, 0);
      return !std::isfinite(l.position.length() + l.direction.length() + l.up.length());
    });
  }

  void read_settings() {
    model_.animations = uint8_t(std::min(scene_.mNumAnimations, 255u));
    for (unsigned i = 0; i < scene_.mNumAnimations; ++i) {
      const aiAnimation& a = *scene_.mAnimations[i];
      const double seconds = a.mDuration / (a.mTicksPerSecond > 0 ? a.mTicksPerSecond : 25);
      if (std::isfinite(seconds)) model_.duration = std::max(model_.duration, seconds);
    }
    if (!scene_.mMetaData) return;
    float centimetres = 0;
    double exact = 0;
    if (scene_.mMetaData->Get("UnitScaleFactor", centimetres) && centimetres > 0)
      model_.metres = double(centimetres) / 100;
    else if (scene_.mMetaData->Get("UnitScaleFactor", exact) && exact > 0)
      model_.metres = exact / 100;
    int32_t axis = 1;
    if (scene_.mMetaData->Get("UpAxis", axis)) model_.z_up = axis == 2;
  }

  void say_what_is_left_out() {
    const auto counted = [](size_t n, const char* one, const char* more) {
      return std::to_string(n) + " " + (n == 1 ? one : more);
    };
    if (thin_faces_ > 0)
      model_.left_out.push_back(counted(thin_faces_, "point or line", "points and lines") + " without a surface");
    if (bad_faces_ > 0)
      model_.left_out.push_back(counted(bad_faces_, "face", "faces") + " with vertices that are not finite or missing");
  }

  const aiScene& scene_;
  const std::string& path_;
  const ModelTime time_;
  const Pose start_, end_;
  bool is_gltf_ = false, has_materials_ = true;
  Model model_;
  std::vector<uint32_t> mesh_at_;
  scenefile::Triangulator triangulator_;
  size_t thin_faces_ = 0, bad_faces_;
};

}  // namespace

M44d to_rows(const aiMatrix4x4& m) {
  return M44d(double(m.a1), double(m.a2), double(m.a3), double(m.a4), double(m.b1), double(m.b2), double(m.b3),
              double(m.b4), double(m.c1), double(m.c2), double(m.c3), double(m.c4), double(m.d1), double(m.d2),
              double(m.d3), double(m.d4));
}

Model read_by_assimp(const std::string& path, const ModelTime& time) {
  Assimp::Importer importer;
  auto* const files = new RegularFiles;
  importer.SetIOHandler(files);  // which it deletes
  const std::string extension = image::extension_of(path);
  const bool is_gltf = extension == "gltf" || extension == "glb";  // whose transforms gltf_extensions.h reads
  const aiScene* scene =
      importer.ReadFile(path, aiProcess_GenUVCoords | (is_gltf ? 0u : unsigned(aiProcess_TransformUVCoords)));
  // Vertices that lie together and hang on different bones would be joined, too.
  const auto has_bones = [&] {
    return std::any_of(scene->mMeshes, scene->mMeshes + scene->mNumMeshes,
                       [](const aiMesh* m) { return m->HasBones(); });
  };
  if (scene && !has_bones()) scene = importer.ApplyPostProcessing(aiProcess_JoinIdenticalVertices);
  if (const std::string damage = files->damage(); !damage.empty()) throw std::runtime_error(damage);
  if (!scene || !scene->mRootNode) throw std::runtime_error(importer.GetErrorString());
  return Converter(*scene, path, time, files->lost_faces()).convert();
}

}  // namespace dapple::modelfile
