// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_codec.h"

#include "dapple/modelfile/flat_buffer.h"

namespace dapple::modelfile {

namespace {

// One list of members serves both ways: `io` is a writer with constant objects or a reader.
template <class Io, class T>
void texture(Io& io, T& t) {
  io(t.file), io(t.image), io(t.uv_set), io(t.wrap), io(t.strength);
}

template <class Io, class M>
void material(Io& io, M& m) {
  io(m.name), io(m.kind), io(m.alpha), io(m.two_sided), io(m.has_volume), io(m.base), io(m.specular_color);
  io(m.emission), io(m.emission_strength), io(m.opacity), io(m.alpha_cutoff), io(m.metalness), io(m.roughness);
  io(m.glossiness), io(m.exponent), io(m.reflectivity), io(m.transmission), io(m.ior), io(m.metal_rough_map);
  io(m.specular_weight), io(m.clearcoat), io(m.clearcoat_roughness), io(m.anisotropy), io(m.sheen);
  io(m.specular_tint), io(m.film), io(m.film_thickness), io(m.film_ior), io(m.attenuation_distance);
  io(m.attenuation_color), io(m.dispersion), texture(io, m.clearcoat_normal_map);
  io(m.sheen_roughness), texture(io, m.clearcoat_map), texture(io, m.clearcoat_roughness_map);
  texture(io, m.base_map), texture(io, m.opacity_map), texture(io, m.normal_map), texture(io, m.bump_map);
  texture(io, m.emission_map), texture(io, m.transmission_map), texture(io, m.metalness_map);
  texture(io, m.roughness_map), io(m.left_out);
}

template <class Io, class M>
void mesh(Io& io, M& m) {
  io(m.name), io(m.material), io(m.P), io(m.P_end), io(m.N);
  for (auto& uv : m.uv) io(uv);
  io(m.color), io(m.indices);
}

template <class Io, class N>
void node(Io& io, N& n) {
  io(n.name), io(n.start), io(n.end), io(n.meshes);
}

template <class Io, class C>
void camera(Io& io, C& c) {
  io(c.name), io(c.eye), io(c.look), io(c.up), io(c.eye_end), io(c.look_end), io(c.up_end), io(c.fov), io(c.aspect);
  io(c.fov_is_vertical);
}

template <class Io, class L>
void light(Io& io, L& l) {
  io(l.name), io(l.type), io(l.physical), io(l.color), io(l.position), io(l.direction), io(l.up), io(l.cone_inner);
  io(l.cone_outer), io(l.constant), io(l.linear), io(l.quadratic), io(l.width), io(l.height);
}

template <class Io, class I>
void image(Io& io, I& i) {
  io(i.name), io(i.extension), io(i.bytes), io(i.width), io(i.height);
}

template <class T, class F>
void write_list(FlatWriter& io, const std::vector<T>& list, F item) {
  io(uint64_t(list.size()));
  for (const T& t : list) item(io, t);
}

// Item by item, and each takes bytes: a damaged count ends with the data.
template <class T, class F>
void read_list(FlatReader& io, std::vector<T>& list, F item) {
  uint64_t n = 0;
  io(n);
  for (uint64_t i = 0; i < n; ++i) item(io, list.emplace_back());
}

}  // namespace

std::string encode_model(const Model& m) {
  FlatWriter io;
  write_list(io, m.materials, [](auto& w, auto& x) { material(w, x); });
  write_list(io, m.meshes, [](auto& w, auto& x) { mesh(w, x); });
  write_list(io, m.nodes, [](auto& w, auto& x) { node(w, x); });
  write_list(io, m.cameras, [](auto& w, auto& x) { camera(w, x); });
  write_list(io, m.lights, [](auto& w, auto& x) { light(w, x); });
  write_list(io, m.images, [](auto& w, auto& x) { image(w, x); });
  io(m.left_out), io(m.z_up), io(m.metres), io(m.animations), io(m.duration);
  return std::move(io.bytes());
}

Model decode_model(std::string_view bytes) {
  Model m;
  FlatReader io(bytes);
  read_list(io, m.materials, [](auto& r, auto& x) { material(r, x); });
  read_list(io, m.meshes, [](auto& r, auto& x) { mesh(r, x); });
  read_list(io, m.nodes, [](auto& r, auto& x) { node(r, x); });
  read_list(io, m.cameras, [](auto& r, auto& x) { camera(r, x); });
  read_list(io, m.lights, [](auto& r, auto& x) { light(r, x); });
  read_list(io, m.images, [](auto& r, auto& x) { image(r, x); });
  io(m.left_out), io(m.z_up), io(m.metres), io(m.animations), io(m.duration);
  if (!io.at_end()) throw std::runtime_error("there are more data than the model has");
  check_model(m);
  return m;
}

}  // namespace dapple::modelfile
