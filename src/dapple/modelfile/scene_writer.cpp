// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/scene_writer.h"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "dapple/image/atomic_file.h"

namespace dapple::modelfile {

namespace fs = std::filesystem;
using namespace scenefile;

namespace {

// Meshes of fewer triangles stand in the scene.
constexpr size_t smallest_file = 16;

template <class T>
std::string number(T x) {
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, x);
  return std::string(text, end.ptr);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

void write_file(const fs::path& path, const std::string& bytes) {
  image::AtomicFile file(path.string());
  file.write(bytes.data(), bytes.size());
  file.commit();
}

template <class T>
void append(std::string* bytes, const T& value) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Binary PLY, little endian as all machines are that Dapple runs on.
std::string ply_of(const ShapeEntity& e) {
  const auto P = e.params.get_points3("P"), N = e.params.get_normals("N");
  const auto uv = e.params.get_points2("uv");
  const auto indices = e.params.get_ints("indices");
  const size_t n = P.size() / 3;
  std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n) +
                    "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!N.empty()) out += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!uv.empty()) out += "property float u\nproperty float v\n";
  out +=
      "element face " + std::to_string(indices.size() / 3) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (size_t i = 0; i < n; ++i) {
    for (size_t k = 0; k < 3; ++k) append(&out, P[3 * i + k]);
    for (size_t k = 0; k < 3 && !N.empty(); ++k) append(&out, N[3 * i + k]);
    for (size_t k = 0; k < 2 && !uv.empty(); ++k) append(&out, uv[2 * i + k]);
  }
  for (size_t i = 0; i + 2 < indices.size(); i += 3) {
    out += char(3);
    for (size_t k = 0; k < 3; ++k) append(&out, indices[i + k]);
  }
  return out;
}

class SceneWriter {
 public:
  SceneWriter(const SceneDescription& d, const std::string& path) : d_(d), path_(path) {
    std::error_code ignored;
    directory_ = fs::absolute(path_, ignored).lexically_normal().parent_path();
    folder_ = fs::path(path_).stem().string() + "_files";
    written_.folder = (fs::path(path_).parent_path() / folder_).string();
  }

  WrittenScene write() {
    out_ << "# " << (d_.files.empty() ? "" : fs::path(d_.files.front()).filename().string())
         << " as a scene, by dapple convert\n\n";
    if (!d_.film.type.empty()) directive("Film", d_.film);
    transform(d_.world_to_camera, "Transform");
    directive("Camera", d_.camera);
    out_ << "\nWorldBegin\n";
    section("Textures", d_.textures.size());
    for (const TextureEntity& t : d_.textures) texture(t);
    section("Materials", d_.materials.size() - 1);
    for (const MaterialEntity& m : d_.materials)
      if (!m.name.empty()) {
        out_ << "MakeNamedMaterial " << quoted(m.name);
        params(m.params);
      }
    section("Lights", d_.lights.size());
    for (const LightEntity& l : d_.lights) light(l);
    section("Objects", d_.objects.size());
    for (const ObjectEntity& o : d_.objects) {
      out_ << "ObjectBegin " << quoted(o.name) << "\n";
      for (const ShapeEntity& s : o.shapes) shape(s);
      for (const InstanceEntity& i : o.instances) instance(i);
      for (const PlacementsEntity& p : o.placements) placements(p);
      out_ << "ObjectEnd\n";
    }
    section("Shapes", d_.shapes.size());
    for (const ShapeEntity& s : d_.shapes) shape(s);
    section("Instances", d_.instances.size());
    for (const InstanceEntity& i : d_.instances) instance(i);
    for (const PlacementsEntity& p : d_.placements) placements(p);
    write_file(path_, out_.str());
    return written_;
  }

 private:
  void section(const char* name, size_t items) {
    if (items > 0) out_ << "\n# " << name << "\n";
  }

  void matrix(const Transform& t, const char* name) {
    out_ << name << " [";
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) out_ << ' ' << number(t.matrix()[row][column]);
    out_ << " ]\n";
  }
  void transform(const TransformPair& t, const char* name) {
    if (!t.is_animated()) {
      if (!t.start.is_identity()) matrix(t.start, name);
      return;
    }
    out_ << "ActiveTransform StartTime\n";
    matrix(t.start, name);
    out_ << "ActiveTransform EndTime\n";
    matrix(t.end, name);
    out_ << "ActiveTransform All\n";
  }

  void directive(const char* name, const Entity& e) {
    out_ << name << ' ' << quoted(e.type);
    params(e.params);
  }

  void params(const ParamSet& set) {
    for (const Param& p : set.all()) param(p);
    out_ << "\n";
  }
  void param(const Param& p) {
    out_ << " \"" << name_of(p.type) << ' ' << p.name << "\" [";
    const bool is_file = p.name == "filename" || p.name == "normalmap" || p.name == "coat_normalmap";
    if (p.type == ParamType::boolean) {
      for (const int32_t i : p.integers) out_ << (i ? " true" : " false");
    } else {
      for (const int32_t i : p.integers) out_ << ' ' << i;
      if (!p.exact.empty())
        for (const double x : p.exact) out_ << ' ' << number(x);
      else
        for (const float x : p.numbers) out_ << ' ' << number(x);
      for (const std::string& s : p.strings) out_ << ' ' << quoted(is_file ? file(s) : s);
    }
    out_ << " ]";
  }

  // Those of temporary folders are copied: their names say so.
  std::string file(const std::string& name) {
    const auto known = files_.find(name);
    if (known != files_.end()) return known->second;
    std::error_code ignored;
    const fs::path from = fs::absolute(d_.resolve(name), ignored).lexically_normal();
    const fs::path temporary = fs::temp_directory_path(ignored);
    std::string out = from.lexically_relative(directory_).string();
    if (d_.temporary_files && from.string().starts_with(temporary.string()) &&
        from.string().find("dapple") != std::string::npos) {
      make_folder();
      std::ifstream in(from, std::ios::binary);
      std::ostringstream bytes;
      bytes << in.rdbuf();
      out = folder_ + "/" + std::to_string(written_.pictures++) + "-" + from.filename().string();
      write_file(directory_ / out, bytes.str());
    }
    return files_[name] = out;
  }

  void make_folder() {
    std::error_code error;
    fs::create_directory(directory_ / folder_, error);
    if (error) throw IoError("cannot make the folder \"" + (directory_ / folder_).string() + "\": " + error.message());
  }

  void texture(const TextureEntity& t) {
    out_ << "Texture " << quoted(t.name) << (t.is_spectrum ? " \"spectrum\" " : " \"float\" ") << quoted(t.type);
    params(t.params);
  }

  void instance(const InstanceEntity& i) {
    out_ << "AttributeBegin\n";
    transform(i.transform.exact(), "ConcatTransform");
    out_ << "ObjectInstance " << quoted(d_.objects[size_t(i.object)].name) << "\nAttributeEnd\n";
  }
  void placements(const PlacementsEntity& p) {
    out_ << "AttributeBegin\n";
    if (!p.transform.is_identity()) matrix(p.transform, "ConcatTransform");
    out_ << "ObjectInstances " << quoted(d_.objects[size_t(p.object)].name) << " \"string filename\" "
         << quoted(file(p.filename)) << "\nAttributeEnd\n";
  }

  void light(const LightEntity& l) {
    out_ << "AttributeBegin\n";
    transform(l.transform, "ConcatTransform");
    directive("LightSource", l);
    out_ << "AttributeEnd\n";
  }

  void shape(const ShapeEntity& s) {
    ++written_.shapes;
    out_ << "AttributeBegin\n";
    transform(s.transform, "ConcatTransform");
    if (s.reverse_orientation) out_ << "ReverseOrientation\n";
    const MaterialEntity& m = d_.materials[size_t(s.material)];
    if (!m.name.empty()) out_ << "NamedMaterial " << quoted(m.name) << "\n";
    if (s.area_light >= 0) directive("AreaLightSource", d_.area_lights[size_t(s.area_light)]);
    const Param* const indices = s.params.find("indices");
    const bool beside =
        s.type == "trianglemesh" && indices && indices->integers.size() / 3 >= smallest_file && !s.params.find("P1");
    if (!beside) {
      directive("Shape", s);
    } else {
      make_folder();
      char name[32];
      std::snprintf(name, sizeof name, "/%05zu.ply", ++written_.meshes);
      write_file(directory_ / (folder_ + name), ply_of(s));
      out_ << "Shape \"plymesh\" \"string filename\" [ " << quoted(folder_ + name) << " ]";
      for (const Param& p : s.params.all())
        if (p.name != "P" && p.name != "N" && p.name != "uv" && p.name != "indices") param(p);
      out_ << "\n";
    }
    out_ << "AttributeEnd\n";
  }

  const SceneDescription& d_;
  const std::string path_;
  fs::path directory_;
  std::string folder_;
  std::ostringstream out_;
  std::map<std::string, std::string> files_;
  WrittenScene written_;
};

}  // namespace

WrittenScene write_scene(const SceneDescription& description, const std::string& path) {
  return SceneWriter(description, path).write();
}

}  // namespace dapple::modelfile
