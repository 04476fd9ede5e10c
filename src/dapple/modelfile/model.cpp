// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model.h"

#include <cmath>
#include <stdexcept>

namespace dapple::modelfile {

namespace {

void require(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

bool finite(const RGB& c) {
  return c.is_finite() && c.min() >= 0;
}
bool finite(const V3d& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool finite(const M44d& m) {
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k)
      if (!std::isfinite(m[i][k])) return false;
  return true;
}

void check(const ModelTexture& t, const Model& model) {
  require(t.image >= -1 && t.image < int64_t(model.images.size()), "a texture names an image that there is not");
  require(t.uv_set < 4 && std::isfinite(t.strength), "a texture is damaged");
}

void check(const ModelMaterial& m, const Model& model) {
  require(m.kind <= ModelMaterial::unlit && m.alpha <= ModelMaterial::blend, "a material is damaged");
  for (const RGB* c : {&m.base, &m.specular_color, &m.emission, &m.sheen, &m.specular_tint, &m.attenuation_color})
    require(finite(*c), "a colour is not finite");
  for (const float x : {m.emission_strength,
                        m.opacity,
                        m.alpha_cutoff,
                        m.metalness,
                        m.roughness,
                        m.glossiness,
                        m.exponent,
                        m.reflectivity,
                        m.transmission,
                        m.ior,
                        m.specular_weight,
                        m.clearcoat,
                        m.clearcoat_roughness,
                        m.anisotropy,
                        m.sheen_roughness,
                        m.film,
                        m.film_thickness,
                        m.film_ior,
                        m.attenuation_distance,
                        m.dispersion})
    require(std::isfinite(x), "a number of a material is not finite");
  for (const ModelTexture* t :
       {&m.base_map, &m.opacity_map, &m.normal_map, &m.bump_map, &m.emission_map, &m.transmission_map, &m.metalness_map,
        &m.roughness_map, &m.clearcoat_map, &m.clearcoat_roughness_map, &m.clearcoat_normal_map})
    check(*t, model);
}

void check(const ModelMesh& mesh, const Model& model) {
  require(mesh.material < model.materials.size(), "a mesh names a material that there is not");
  const size_t n = mesh.P.size();
  const auto fits = [n](size_t count) { return count == 0 || count == n; };
  require(fits(mesh.P_end.size()) && fits(mesh.N.size()) && fits(mesh.color.size()), "lists of vertices differ");
  for (const auto& uv : mesh.uv) require(fits(uv.size()), "lists of vertices differ");
  for (const auto* points : {&mesh.P, &mesh.P_end, &mesh.N})
    for (const V3f& p : *points) require(is_finite(p), "a vertex is not finite");
  for (const auto& uv : mesh.uv)
    for (const V2f& t : uv) require(std::isfinite(t.x) && std::isfinite(t.y), "a texture coordinate is not finite");
  for (const RGB& c : mesh.color) require(finite(c), "a colour of a vertex is not finite");
  require(mesh.indices.size() % 3 == 0, "the corners of triangles are no multiple of three");
  for (const int32_t i : mesh.indices) require(i >= 0 && size_t(i) < n, "a triangle names a vertex that there is not");
}

void check(const ModelLight& l) {
  require(l.type <= ModelLight::area && finite(l.color), "a light is damaged");
  for (const V3d* v : {&l.position, &l.direction, &l.up}) require(finite(*v), "a light's place is not finite");
  for (const float x : {l.cone_inner, l.cone_outer, l.constant, l.linear, l.quadratic, l.width, l.height})
    require(std::isfinite(x) && x >= 0, "a number of a light is not finite");
}

}  // namespace

Imath::Box3d bounds_of(const Model& model) {
  Imath::Box3d box;
  for (const ModelNode& node : model.nodes) {
    const M44d& m = node.start;
    for (const uint32_t mesh : node.meshes)
      for (const V3f& p : model.meshes[mesh].P) {
        V3d q;
        for (int i = 0; i < 3; ++i)
          q[i] = m[i][0] * double(p.x) + m[i][1] * double(p.y) + m[i][2] * double(p.z) + m[i][3];
        box.extendBy(q);
      }
  }
  return box;
}

void check_model(const Model& model) {
  for (const ModelMaterial& m : model.materials) check(m, model);
  for (const ModelMesh& m : model.meshes) check(m, model);
  for (const ModelNode& n : model.nodes) {
    require(finite(n.start) && finite(n.end), "a node's transform is not finite");
    for (const uint32_t m : n.meshes) require(m < model.meshes.size(), "a node names a mesh that there is not");
  }
  for (const ModelCamera& c : model.cameras) {
    for (const V3d* v : {&c.eye, &c.look, &c.up, &c.eye_end, &c.look_end, &c.up_end})
      require(finite(*v), "a camera's place is not finite");
    require(std::isfinite(c.fov) && std::isfinite(c.aspect), "a number of a camera is not finite");
  }
  for (const ModelLight& l : model.lights) check(l);
  for (const ModelImage& i : model.images)
    require(i.width == 0 || i.bytes.size() == uint64_t(i.width) * i.height * 4, "an image has not the size it names");
  require(std::isfinite(model.metres) && std::isfinite(model.duration), "a number is not finite");
}

}  // namespace dapple::modelfile
