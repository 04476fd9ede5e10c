// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/shape_factory.h"

#include "dapple/build/cage_factory.h"
#include "dapple/build/curve_factory.h"
#include "dapple/build/disk_factory.h"
#include "dapple/build/shape_params.h"
#include "dapple/geom/loop_subdivision.h"
#include "dapple/modelfile/scene_reader.h"

namespace dapple::build {

using geom::Mesh;
using scenefile::ParamSet;
using scenefile::ShapeEntity;

namespace {

std::vector<uint32_t> index_list(const ShapeEntity& e, size_t multiple, size_t vertices) {
  const auto ints = e.params.get_ints("indices");
  check_indices(e, "indices", ints, vertices);
  if (ints.size() % multiple != 0)
    throw InputError(e.loc, "\"indices\" has " + std::to_string(ints.size()) + " numbers; expected a multiple of " +
                                std::to_string(multiple));
  return {ints.begin(), ints.end()};
}

// Takes a mesh from object to target space and settles which side is outside.
void place(Mesh& mesh, const ShapeEntity& e, const Transform& to_target) {
  const auto move = [&](std::vector<V3f>& points) {
    if (to_target.is_identity()) return;
    for (V3f& p : points) p = to_target.point(p);
  };
  move(mesh.P);
  move(mesh.P_end);
  for (const V3f& p : mesh.P)
    if (!is_finite(p)) throw InputError(e.loc, "a vertex is not finite after its transform");
  for (V3f& n : mesh.N) {
    if (!to_target.is_identity()) n = to_target.normal(n);
    const float l = length(n);
    if (!(l > 0) || !std::isfinite(l)) {
      n = V3f(0, 0, 0);
      continue;
    }
    n *= (e.reverse_orientation ? -1.0f : 1.0f) / l;
  }
  mesh.flip = e.reverse_orientation != to_target.swaps_handedness();
}

// A bilinear patch that is not flat becomes this many quads to a side.
constexpr int patch_dice = 16;

bool is_flat(const V3f p[4]) {
  const V3f n = cross(p[2] - p[0], p[3] - p[1]);
  const float size = length(p[2] - p[0]) + length(p[3] - p[1]);
  return std::abs(dot(p[1] - p[0], n)) <= 1e-5f * size * length(n) || length2(n) == 0;
}

// Quads around their corners with uv and normals; patches that are not flat are diced.
Mesh dice_patches(Mesh&& patches) {
  bool flat = true;
  for (size_t f = 0; flat && f < patches.face_count(); ++f) {
    V3f c[4];
    patches.corners_at(uint32_t(f), 0, c);
    flat = is_flat(c);
  }
  if (flat) return std::move(patches);
  Mesh out;
  out.corners = 4;
  for (size_t f = 0; f < patches.face_count(); ++f) {
    const uint32_t* index = &patches.indices[f * 4];
    const uint32_t base = uint32_t(out.P.size());
    constexpr V2f unit[4] = {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)};
    for (int j = 0; j <= patch_dice; ++j)
      for (int i = 0; i <= patch_dice; ++i) {
        const float u = float(i) / patch_dice, v = float(j) / patch_dice;
        const float b[4] = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
        V3f p(0, 0, 0), n(0, 0, 0);
        V2f t(0, 0);
        for (int k = 0; k < 4; ++k) {
          p += patches.P[index[k]] * b[k];
          if (!patches.N.empty()) n += patches.N[index[k]] * b[k];
          t += (patches.uv.empty() ? unit[k] : patches.uv[index[k]]) * b[k];
        }
        if (patches.N.empty()) {
          const V3f* P = patches.P.data();
          const V3f du = (P[index[1]] - P[index[0]]) * (1 - v) + (P[index[2]] - P[index[3]]) * v;
          const V3f dv = (P[index[3]] - P[index[0]]) * (1 - u) + (P[index[2]] - P[index[1]]) * u;
          n = cross(du, dv);
          if (patches.flip) n = -n;
        }
        out.P.push_back(p);
        out.N.push_back(length2(n) > 0 ? normalize(n) : n);
        out.uv.push_back(t);
      }
    for (uint32_t j = 0; j < patch_dice; ++j)
      for (uint32_t i = 0; i < patch_dice; ++i) {
        const uint32_t a = base + j * (patch_dice + 1) + i;
        for (const uint32_t v : {a, a + 1, a + patch_dice + 2, a + patch_dice + 1}) out.indices.push_back(v);
        out.source_face.push_back(uint32_t(f));
      }
  }
  return out;
}

Mesh triangle_mesh(const ShapeEntity& e, const Transform& to_target) {
  Mesh mesh;
  mesh.P = points3(e.params.get_points3("P"));
  mesh.P_end = points_at_close(e);
  mesh.N = points3(e.params.get_normals("N"));
  mesh.uv = points2(e.params.get_points2("uv"));
  e.params.get_vectors3("S");
  e.params.get_ints("faceIndices");
  mesh.indices = index_list(e, 3, mesh.P.size());
  if (mesh.indices.empty() && mesh.P.size() == 3) mesh.indices = {0, 1, 2};
  check_count(e, "N", mesh.N.size(), mesh.P.size());
  check_count(e, "uv", mesh.uv.size(), mesh.P.size());
  check_count(e, "P1", mesh.P_end.size(), mesh.P.size());
  place(mesh, e, with_base(to_target, e.params.base_of("P")));
  return mesh;
}

Mesh bilinear_mesh(const BuildContext& context, const ShapeEntity& e, const Transform& to_target) {
  Mesh mesh;
  mesh.corners = 4;
  mesh.P = points3(e.params.get_points3("P"));
  mesh.N = points3(e.params.get_normals("N"));
  mesh.uv = points2(e.params.get_points2("uv"));
  e.params.get_ints("faceIndices");
  mesh.indices = index_list(e, 4, mesh.P.size());
  if (mesh.indices.empty() && mesh.P.size() == 4) mesh.indices = {0, 1, 2, 3};
  check_count(e, "N", mesh.N.size(), mesh.P.size());
  check_count(e, "uv", mesh.uv.size(), mesh.P.size());
  if (e.params.find("emissionfilename"))
    context.diagnostics.unsupported(e.loc, "bilinearmesh \"emissionfilename\"", "uniform emission");
  // pbrt lists corners (0,0), (1,0), (0,1), (1,1).
  for (size_t i = 0; i < mesh.indices.size(); i += 4) std::swap(mesh.indices[i + 2], mesh.indices[i + 3]);
  place(mesh, e, with_base(to_target, e.params.base_of("P")));
  return mesh;
}

std::vector<Mesh> ply_mesh(const BuildContext& context, const ShapeEntity& e, const Transform& object_to_target) {
  const std::string filename = e.params.get_string("filename", "");
  if (filename.empty()) throw InputError(e.loc, "plymesh needs \"string filename\"");
  for (const char* name : {"displacement.edgelength", "edgelength"}) e.params.find(name);
  scenefile::PlyMesh ply;
  try {
    ply = read_ply(context, e, context.description.resolve(filename));
  } catch (const InputError& error) {
    if (!context.keep_going) throw;
    context.diagnostics.warn(e.loc, std::string(error.what()) + "; a cube stands in");
    Mesh cube = stand_in_cube();
    place(cube, e, object_to_target);
    return {std::move(cube)};
  }
  const Transform to_target = with_base(object_to_target, ply.base);
  std::vector<Mesh> meshes;
  const bool both = !ply.tri_indices.empty() && !ply.quad_indices.empty();
  if (!ply.quad_indices.empty()) {
    Mesh quads;
    quads.corners = 4;
    quads.P = both ? ply.P : std::move(ply.P);
    quads.N = both ? ply.N : std::move(ply.N);
    quads.uv = both ? ply.uv : std::move(ply.uv);
    quads.indices.assign(ply.quad_indices.begin(), ply.quad_indices.end());
    place(quads, e, to_target);
    meshes.push_back(std::move(quads));
  }
  if (!ply.tri_indices.empty()) {
    Mesh triangles;
    triangles.P = std::move(ply.P);
    triangles.N = std::move(ply.N);
    triangles.uv = std::move(ply.uv);
    triangles.indices.assign(ply.tri_indices.begin(), ply.tri_indices.end());
    place(triangles, e, to_target);
    meshes.push_back(std::move(triangles));
  }
  return meshes;
}

// A model's meshes without its materials.
std::vector<Mesh> model_mesh(const BuildContext& context, const ShapeEntity& e, const Transform& to_target) {
  const std::string filename = e.params.get_string("filename", "");
  if (filename.empty()) throw InputError(e.loc, "shape \"" + e.type + "\" needs \"string filename\"");
  Mesh mesh;
  try {
    const modelfile::Model model = modelfile::read_model(context.description.resolve(filename), {}, e.loc);
    modelfile::ModelMesh joined = modelfile::joined_meshes(model);
    mesh.P = std::move(joined.P);
    mesh.N = std::move(joined.N);
    mesh.uv = std::move(joined.uv[0]);
    mesh.indices.assign(joined.indices.begin(), joined.indices.end());
  } catch (const InputError& error) {
    if (!context.keep_going) throw;
    context.diagnostics.warn(e.loc, std::string(error.what()) + "; a cube stands in");
    mesh = stand_in_cube();
  }
  place(mesh, e, to_target);
  std::vector<Mesh> list;
  list.push_back(std::move(mesh));
  return list;
}

std::vector<trace::Shape> subdivided_loop(const ShapeEntity& e, const geom::ControlCage& cage,
                                          const Transform& to_target, int most_levels) {
  int levels = e.params.get_int("levels", 3);
  if (levels < 0) throw InputError(e.loc, "\"levels\" is negative");
  levels = std::min(levels, most_levels);
  try {
    Mesh mesh = geom::subdivide_loop(cage.P, cage.indices, levels);
    place(mesh, e, to_target);
    return {std::make_shared<const Mesh>(std::move(mesh))};
  } catch (const std::invalid_argument& error) {
    throw InputError(e.loc, error.what());
  }
}

std::vector<trace::Shape> diced(const BuildContext& context, const ShapeEntity& e, geom::ControlCage&& cage,
                                const Dicing& dicing) {
  std::unique_ptr<DicePlan> plan = plan_cage(context, e, std::move(cage), dicing);
  if (!plan) return {};
  if (dicing.plan) {
    *dicing.plan = std::move(plan);
    return {};
  }
  const trace::GridsPtr grids = plan->dice();
  if (!grids) return {};
  return {grids};
}

// A cage that subdivision takes in object space.
std::vector<trace::Shape> diced(const BuildContext& context, const ShapeEntity& e, geom::ControlCage&& cage,
                                const Transform& to_target, const Dicing& dicing) {
  for (auto* points : {&cage.P, &cage.P_end})
    for (V3f& p : *points) p = to_target.point(p);
  cage.flip = e.reverse_orientation != to_target.swaps_handedness();
  return diced(context, e, std::move(cage), dicing);
}

std::vector<trace::Shape> loop_subdivision(const BuildContext& context, const ShapeEntity& e,
                                           const Transform& to_target, const Dicing& dicing) {
  geom::ControlCage cage = loop_cage(context, e);
  e.params.get_string("scheme", "loop");
  const Transform placed = with_base(to_target, e.params.base_of("P"));
  const bool is_diced = e.params.get_bool("diced", false);
  if (!is_diced && !is_displaced(e, dicing)) return subdivided_loop(e, cage, placed, dicing.most_levels);
  e.params.get_int("levels", 3);
  return diced(context, e, std::move(cage), placed, dicing);
}

// Meshes over the same vertices as they are, or diced where they are displaced.
std::vector<trace::Shape> meshes(const BuildContext& context, const ShapeEntity& e, std::vector<Mesh>&& list,
                                 const Dicing& dicing) {
  e.params.get_bool("lod", true);  // acts by dicing.pruning_view
  if (is_displaced(e, dicing)) return diced(context, e, polygon_cage(std::move(list)), dicing);
  std::vector<trace::Shape> shapes;
  for (Mesh& mesh : list) {
    if (mesh.corners == 4) mesh = dice_patches(std::move(mesh));
    if (dicing.pruning_view) vegetation::prune(&mesh, *dicing.pruning_view, dicing.pruning_pixels, dicing.pruned);
    shapes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
  }
  return shapes;
}

float positive(const ShapeEntity& e, const char* name, float fallback) {
  const float v = e.params.get_float(name, fallback);
  if (!(v > 0))
    throw InputError(e.loc, std::string("\"") + name + "\" is " + std::to_string(v) + "; it must be above 0");
  return v;
}

bool has_face(const geom::Quadric& q, const ShapeEntity& e) {
  const bool wide = q.kind() == geom::QuadricKind::disk ? q.inner_radius() < q.radius() : q.z_min() < q.z_max();
  return wide && e.params.get_float("phimax", 360) > 0;
}

float sweep(const ShapeEntity& e) {
  return radians(std::clamp(e.params.get_float("phimax", 360), 0.001f, 360.0f));
}

trace::Shape quadric(const ShapeEntity& e, const Transform& to_target) {
  using geom::Quadric;
  const float radius = positive(e, "radius", 1);
  const auto make = [](Quadric q) { return std::make_shared<const Quadric>(std::move(q)); };
  if (e.type == "sphere")
    return make(Quadric::sphere(to_target, radius, e.params.get_float("zmin", -radius),
                                e.params.get_float("zmax", radius), sweep(e), e.reverse_orientation));
  if (e.type == "cylinder")
    return make(Quadric::cylinder(to_target, radius, e.params.get_float("zmin", -1), e.params.get_float("zmax", 1),
                                  sweep(e), e.reverse_orientation));
  const float inner = e.params.get_float("innerradius", 0);
  if (inner < 0 || inner > radius) throw InputError(e.loc, "\"innerradius\" must be from 0 to \"radius\"");
  return make(
      Quadric::disk(to_target, e.params.get_float("height", 0), radius, inner, sweep(e), e.reverse_orientation));
}

std::vector<trace::Shape> by_type(const BuildContext& context, const ShapeEntity& e, const Transform& to_target,
                                  const Dicing& dicing) {
  if (e.type == "mesh" || (e.type == "trianglemesh" && e.params.find("filename") && !e.params.find("P")))
    return meshes(context, e, model_mesh(context, e, to_target), dicing);
  if (e.type == "trianglemesh") return meshes(context, e, {triangle_mesh(e, to_target)}, dicing);
  if (e.type == "plymesh") return meshes(context, e, ply_mesh(context, e, to_target), dicing);
  if (e.type == "bilinearmesh") return meshes(context, e, {bilinear_mesh(context, e, to_target)}, dicing);
  if (e.type == "sphere" || e.type == "disk" || e.type == "cylinder") return {quadric(e, to_target)};
  if (e.type == "loopsubdiv") return loop_subdivision(context, e, to_target, dicing);
  if (e.type == "catmullclark") {
    V3d base(0, 0, 0);
    geom::ControlCage cage = catmull_clark_cage(context, e, &base);
    return diced(context, e, std::move(cage), with_base(to_target, base), dicing);
  }
  if (e.type == "curve") {
    const bool is_fibre = context.description.materials[size_t(e.material)].type == "hair";
    return {make_curve(e, with_base(to_target, e.params.base_of("P")), is_fibre)};
  }
  if (e.type == "disks") {
    if (const trace::DisksPtr disks = make_disks(context, e, to_target)) return {disks};
    return {};
  }
  throw InputError(e.loc, "shape \"" + e.type + "\" is unknown; " +
                              one_of({"trianglemesh", "plymesh", "mesh", "bilinearmesh", "sphere", "disk", "cylinder",
                                      "loopsubdiv", "catmullclark", "curve", "disks"}));
}

}  // namespace

std::vector<trace::Shape> make_shapes(const BuildContext& context, const ShapeEntity& e, const Transform& to_target,
                                      const Dicing& dicing) {
  std::vector<trace::Shape> shapes = by_type(context, e, to_target, dicing);
  for (const char* read_later : {"alpha", "opacity"}) e.params.find(read_later);
  e.params.report_unused("shape \"" + e.type + "\"", context.diagnostics);
  std::erase_if(shapes, [&e](const trace::Shape& s) {
    if (const auto* quadric = std::get_if<trace::QuadricPtr>(&s)) return !has_face(**quadric, e);
    const auto* mesh = std::get_if<trace::MeshPtr>(&s);
    return mesh && (*mesh)->indices.empty();
  });
  if (shapes.empty() && !(dicing.plan && *dicing.plan))
    context.diagnostics.warn(e.loc, "shape \"" + e.type + "\" has no face: " + why_no_face(e));
  return shapes;
}

}  // namespace dapple::build
