// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/cage_factory.h"

#include <algorithm>
#include <cctype>
#include <iterator>

#include "dapple/build/shape_params.h"
#include "dapple/scenefile/polygon.h"

namespace dapple::build {

using geom::ControlCage;
using scenefile::ShapeEntity;

namespace {

std::vector<uint32_t> unsigned_list(std::span<const int32_t> ints) {
  return {ints.begin(), ints.end()};
}

std::string counted(size_t n, const char* what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

void check_sharpness(const ShapeEntity& e, const char* name, std::span<const float> values) {
  for (const float s : values)
    if (!(s >= 0))
      throw InputError(e.loc, std::string("\"") + name + "\" is " + std::to_string(s) + "; it must be 0 or more");
}

void read_creases(const ShapeEntity& e, ControlCage* cage) {
  const auto vertices = e.params.get_ints("creaseindices");
  const auto lengths = e.params.get_ints("creaselengths");
  const auto sharpness = e.params.get_floats("creasesharpness");
  check_sharpness(e, "creasesharpness", sharpness);
  if (vertices.empty()) return;
  check_indices(e, "creaseindices", vertices, cage->P.size());
  if (lengths.empty() && vertices.size() % 2 != 0)
    throw InputError(e.loc, "\"creaseindices\" has " + std::to_string(vertices.size()) +
                                " numbers; expected pairs, or \"creaselengths\"");
  const size_t chains = lengths.empty() ? vertices.size() / 2 : lengths.size();
  size_t first = 0;
  std::vector<uint32_t> chain_of_edge;
  for (size_t c = 0; c < chains; ++c) {
    const int64_t n = lengths.empty() ? 2 : lengths[c];
    if (n < 2 || size_t(n) > vertices.size() - first)
      throw InputError(e.loc, "\"creaselengths\" has " + std::to_string(n) + "; expected 2 or more, and " +
                                  counted(vertices.size(), "vertex number") + " in all");
    for (size_t i = first; i + 1 < first + size_t(n); ++i) {
      cage->crease_edges.push_back(uint32_t(vertices[i]));
      cage->crease_edges.push_back(uint32_t(vertices[i + 1]));
      chain_of_edge.push_back(uint32_t(c));
    }
    first += size_t(n);
  }
  if (first != vertices.size())
    throw InputError(e.loc, "\"creaselengths\" covers " + std::to_string(first) + " of " +
                                counted(vertices.size(), "crease vertex number"));
  const size_t edges = chain_of_edge.size();
  if (sharpness.size() != 1 && sharpness.size() != chains && sharpness.size() != edges)
    throw InputError(e.loc, "\"creasesharpness\" has " + counted(sharpness.size(), "value") +
                                "; expected 1, or one for each of " + counted(chains, "chain") + " or " +
                                counted(edges, "edge"));
  for (size_t i = 0; i < edges; ++i)
    cage->crease_sharpness.push_back(sharpness[sharpness.size() == 1       ? 0
                                               : sharpness.size() == edges ? i
                                                                           : chain_of_edge[i]]);
}

void read_corners_and_holes(const ShapeEntity& e, ControlCage* cage) {
  const auto corners = e.params.get_ints("cornerindices");
  const auto sharpness = e.params.get_floats("cornersharpness");
  check_sharpness(e, "cornersharpness", sharpness);
  check_indices(e, "cornerindices", corners, cage->P.size());
  if (!corners.empty() && sharpness.size() != 1 && sharpness.size() != corners.size())
    throw InputError(e.loc, "\"cornersharpness\" has " + counted(sharpness.size(), "value") +
                                "; expected 1, or one for each of " + counted(corners.size(), "corner"));
  cage->corners = unsigned_list(corners);
  for (size_t i = 0; i < corners.size(); ++i)
    cage->corner_sharpness.push_back(sharpness[sharpness.size() == 1 ? 0 : i]);
  const auto holes = e.params.get_ints("holes");
  for (const int32_t f : holes)
    if (f < 0 || size_t(f) >= cage->face_count())
      throw InputError(
          e.loc, "\"holes\" names face " + std::to_string(f) + " of a mesh of " + counted(cage->face_count(), "face"));
  cage->holes = unsigned_list(holes);
}

void read_own_mesh(const ShapeEntity& e, ControlCage* cage) {
  cage->P = points3(e.params.get_points3("P"));
  cage->P_end = points_at_close(e);
  cage->uv = points2(e.params.get_points2("uv"));
  const auto indices = e.params.get_ints("indices");
  check_indices(e, "indices", indices, cage->P.size());
  check_count(e, "P1", cage->P_end.size(), cage->P.size());
  cage->indices = unsigned_list(indices);
  const auto uv_indices = e.params.get_ints("uvindices");
  if (uv_indices.empty()) {
    check_count(e, "uv", cage->uv.size(), cage->P.size());
  } else {
    check_indices(e, "uvindices", uv_indices, cage->uv.size());
    if (uv_indices.size() != indices.size())
      throw InputError(e.loc, "\"uvindices\" has " + counted(uv_indices.size(), "number") + " for " +
                                  std::to_string(indices.size()) + " \"indices\"");
    cage->uv_indices = unsigned_list(uv_indices);
  }
  cage->face_sizes = face_sizes(e, indices.size(), 4);
}

bool is_obj(std::string name) {
  for (char& c : name) c = char(std::tolower(static_cast<unsigned char>(c)));
  return name.ends_with(".obj") || name.ends_with(".obj.gz");
}

void read_mesh_file(const BuildContext& context, const ShapeEntity& e, const std::string& path, ControlCage* cage,
                    V3d* base) {
  if (is_obj(path)) {
    scenefile::ObjMesh obj = read_obj(context, e, path);
    *base = obj.base;
    cage->P = std::move(obj.P);
    cage->uv = std::move(obj.uv);
    cage->face_sizes = std::move(obj.face_sizes);
    cage->indices = std::move(obj.indices);
    cage->uv_indices = std::move(obj.uv_indices);
    return;
  }
  scenefile::PlyMesh ply = read_ply(context, e, path);
  const auto add = [&](const std::vector<int32_t>& corners, uint32_t size) {
    cage->indices.insert(cage->indices.end(), corners.begin(), corners.end());
    cage->face_sizes.insert(cage->face_sizes.end(), corners.size() / size, size);
  };
  add(ply.tri_indices, 3);
  add(ply.quad_indices, 4);
  *base = ply.base;
  cage->P = std::move(ply.P);
  cage->uv = std::move(ply.uv);
  if (ply.repeats.empty()) return;
  // Vertices that differ in texture coordinates alone are one vertex of the surface.
  cage->uv_indices = cage->indices;
  const size_t own = cage->P.size() - ply.repeats.size();
  for (uint32_t& i : cage->indices)
    if (i >= own) i = uint32_t(ply.repeats[i - own]);
  cage->P.resize(own);
}

// Edges of faces of n corners that no neighbour has the other way round.
size_t lone_edges(std::span<const int32_t> corners, size_t n) {
  using Edge = std::pair<int32_t, int32_t>;
  std::vector<Edge> edges, opposite;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Edge e(corners[i], corners[i % n == n - 1 ? i + 1 - n : i + 1]);
    edges.push_back(e);
    opposite.emplace_back(e.second, e.first);
  }
  std::sort(edges.begin(), edges.end());
  std::sort(opposite.begin(), opposite.end());
  std::vector<Edge> lone;
  std::set_difference(edges.begin(), edges.end(), opposite.begin(), opposite.end(), std::back_inserter(lone));
  return lone.size();
}

}  // namespace

ControlCage loop_cage(const BuildContext& context, const ShapeEntity& e) {
  ControlCage cage;
  cage.scheme = geom::SurfaceScheme::loop;
  cage.boundary = geom::BoundaryRule::edge_only;
  cage.P = points3(e.params.get_points3("P"));
  const auto corners = e.params.get_ints("indices");
  check_indices(e, "indices", corners, cage.P.size());
  const bool has_sizes = e.params.find("faceverts") != nullptr;
  scenefile::Triangulator triangulator;
  std::vector<int32_t> triangles;
  size_t first = 0, small = 0;
  for (const uint32_t n : face_sizes(e, corners.size(), 3)) {
    if (n >= 3)
      triangulator.add(corners.subspan(first, n), cage.P, &triangles);
    else
      ++small;
    first += n;
  }
  if (small > 0)
    context.diagnostics.warn(
        e.loc, "shape \"loopsubdiv\": " + counted(small, "face") + " left out: expected 3 corners or more");
  // Lists of quads whose number is a multiple of three pass as triangles.
  if (!has_sizes && corners.size() % 4 == 0 && 2 * lone_edges(corners, 4) < lone_edges(corners, 3))
    context.diagnostics.warn(
        e.loc,
        "shape \"loopsubdiv\": \"indices\" are taken as triangles, but fit together as quads; if they are, say so by "
        "\"faceverts\", or use \"catmullclark\"");
  cage.indices = unsigned_list(triangles);
  cage.face_sizes.assign(triangles.size() / 3, 3);
  return cage;
}

ControlCage catmull_clark_cage(const BuildContext& context, const ShapeEntity& e, V3d* base) {
  ControlCage cage;
  cage.scheme = geom::SurfaceScheme::catmull_clark;
  const geom::BoundaryRule rules[] = {geom::BoundaryRule::edge_and_corner, geom::BoundaryRule::edge_only,
                                      geom::BoundaryRule::none};
  cage.boundary = rules[e.params.get_choice("boundary", {"edgeandcorner", "edgeonly", "none"}, 0)];
  const std::string filename = e.params.get_string("filename", "");
  if (filename.empty()) {
    read_own_mesh(e, &cage);
    *base = e.params.base_of("P");
  } else {
    try {
      read_mesh_file(context, e, context.description.resolve(filename), &cage, base);
    } catch (const InputError& error) {
      if (!context.keep_going) throw;
      context.diagnostics.warn(e.loc, std::string(error.what()) + "; a cube stands in");
      return polygon_cage({stand_in_cube()});
    }
  }
  read_creases(e, &cage);
  read_corners_and_holes(e, &cage);
  if (!filename.empty()) cage.weld();
  return cage;
}

ControlCage polygon_cage(std::vector<geom::Mesh> meshes) {
  ControlCage cage;
  cage.scheme = geom::SurfaceScheme::polygons;
  for (const geom::Mesh& mesh : meshes) {
    cage.indices.insert(cage.indices.end(), mesh.indices.begin(), mesh.indices.end());
    cage.face_sizes.insert(cage.face_sizes.end(), mesh.face_count(), uint32_t(mesh.corners));
  }
  if (meshes.empty()) return cage;
  geom::Mesh& mesh = meshes.front();
  cage.P = std::move(mesh.P);
  cage.P_end = std::move(mesh.P_end);
  cage.N = std::move(mesh.N);
  cage.uv = std::move(mesh.uv);
  cage.flip = mesh.flip;
  cage.weld();
  return cage;
}

}  // namespace dapple::build
