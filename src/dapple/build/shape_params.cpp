// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/shape_params.h"

namespace dapple::build {

using scenefile::ShapeEntity;

namespace {

std::string counted(int64_t n, const std::string& one, const std::string& more) {
  return std::to_string(n) + " " + (n == 1 ? one : more);
}

}  // namespace

void check_indices(const ShapeEntity& e, const char* name, std::span<const int32_t> indices, size_t vertices) {
  for (const int32_t i : indices)
    if (i < 0 || size_t(i) >= vertices)
      throw InputError(e.loc, std::string("\"") + name + "\" names vertex " + std::to_string(i) + " of a mesh of " +
                                  std::to_string(vertices) + " vertices");
}

void check_count(const ShapeEntity& e, const char* name, size_t count, size_t vertices) {
  if (count != 0 && count != vertices)
    throw InputError(e.loc, std::string("\"") + name + "\" has " + std::to_string(count) + " values for " +
                                std::to_string(vertices) + " vertices");
}

std::vector<uint32_t> face_sizes(const ShapeEntity& e, size_t corners, uint32_t usual) {
  const auto sizes = e.params.get_ints("faceverts");
  size_t sum = 0;
  for (const int32_t n : sizes) {
    if (n < 0) throw InputError(e.loc, "\"faceverts\" has " + std::to_string(n) + "; it must be 3 or more");
    sum += size_t(n);
  }
  if (sizes.empty() && corners % usual != 0)
    throw InputError(e.loc, "\"indices\" has " + counted(int64_t(corners), "number", "numbers") +
                                "; expected a multiple of " + std::to_string(usual) + ", or \"faceverts\"");
  if (!sizes.empty() && sum != corners)
    throw InputError(e.loc, "\"faceverts\" adds up to " + std::to_string(sum) + " corners; \"indices\" has " +
                                std::to_string(corners));
  return sizes.empty() ? std::vector<uint32_t>(corners / usual, usual)
                       : std::vector<uint32_t>(sizes.begin(), sizes.end());
}

namespace {

class FileWarnings {
 public:
  FileWarnings(const BuildContext& context, const ShapeEntity& e, const std::string& path)
      : context_(context), loc_(e.loc), path_(path) {}
  void add(const std::string& message) const {
    context_.diagnostics.warn(loc_, path_ + ": " + message, path_ + ": " + message);
  }
  void add_ignored_faces(int64_t n) const {
    if (n > 0) add(counted(n, "face", "faces") + " of fewer than 3 corners left out");
  }

 private:
  const BuildContext& context_;
  const FileLoc& loc_;
  const std::string& path_;
};

}  // namespace

scenefile::PlyMesh read_ply(const BuildContext& context, const ShapeEntity& e, const std::string& path) {
  scenefile::PlyMesh ply = scenefile::read_ply(path, e.loc);
  const FileWarnings warnings(context, e, path);
  if (ply.has_more_data) warnings.add("there are more data than the header announces; they are not read");
  warnings.add_ignored_faces(ply.ignored_faces);
  if (ply.bad_normals > 0)
    warnings.add(counted(ply.bad_normals, "normal is", "normals are") + " not finite; taken as none");
  if (ply.bad_uvs > 0)
    warnings.add(counted(ply.bad_uvs, "vertex has", "vertices have") + " u, v that are not finite; taken as 0");
  if (ply.bad_corner_uvs > 0)
    warnings.add(counted(ply.bad_corner_uvs, "corner has", "corners have") +
                 " texture coordinates that are not finite; taken as 0");
  if (ply.many_textures)
    warnings.add("its faces name more than one texture (texnumber); the shape's material is used for all");
  return ply;
}

scenefile::ObjMesh read_obj(const BuildContext& context, const ShapeEntity& e, const std::string& path) {
  scenefile::ObjMesh obj = scenefile::read_obj(path, e.loc);
  const FileWarnings warnings(context, e, path);
  if (obj.doubt) warnings.add(std::string("it is not an OBJ file: ") + obj.doubt);
  warnings.add_ignored_faces(obj.ignored_faces);
  return obj;
}

std::string why_no_face(const ShapeEntity& e) {
  const scenefile::Param* file = e.params.find("filename", scenefile::ParamType::string);
  if (file && file->strings.size() == 1 && !file->strings[0].empty()) return "\"" + file->strings[0] + "\" gives none";
  if (e.type == "sphere" || e.type == "cylinder" || e.type == "disk") {
    if (!(e.params.get_float("phimax", 360) > 0)) return "\"phimax\" is not above 0";
    return e.type == "disk" ? "\"innerradius\" is \"radius\"" : "nothing lies between \"zmin\" and \"zmax\"";
  }
  for (const std::string name : {"\"P\"", "\"indices\""}) {
    const scenefile::Param* p = e.params.find(name.substr(1, name.size() - 2));
    if (!p) return "there is no " + name;
    if (p->numbers.empty() && p->integers.empty()) return name + " is empty";
  }
  return "none is left";
}

std::vector<V3f> points3(std::span<const float> numbers) {
  std::vector<V3f> v(numbers.size() / 3);
  for (size_t i = 0; i < v.size(); ++i) v[i] = V3f(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  return v;
}

std::vector<V3f> points_at_close(const ShapeEntity& e) {
  std::vector<V3f> points = points3(e.params.get_points3("P1"));
  if (points.empty()) return points;
  const V3d shift = e.params.base_of("P1") - e.params.base_of("P");
  if (shift != V3d(0, 0, 0))
    for (V3f& p : points) p = V3f(V3d(p) + shift);
  return points;
}

std::vector<V2f> points2(std::span<const float> numbers) {
  std::vector<V2f> v(numbers.size() / 2);
  for (size_t i = 0; i < v.size(); ++i) v[i] = V2f(numbers[2 * i], numbers[2 * i + 1]);
  return v;
}

geom::Mesh stand_in_cube() {
  geom::Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.P.push_back(V3f(i & 1 ? .5f : -.5f, i & 2 ? .5f : -.5f, i & 4 ? .5f : -.5f));
  mesh.corners = 4;
  mesh.indices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  return mesh;
}

}  // namespace dapple::build
