// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::modelfile {

/// A use of a picture by a material.
struct ModelTexture {
  std::string file;     ///< as the model names it; empty: there is none
  int32_t image = -1;   ///< of Model::images instead
  uint32_t uv_set = 0;  ///< of ModelMesh::uv
  uint8_t wrap = 0;     ///< 0 repeat, 1 clamp, 2 mirror (which is drawn as repeat)
  float strength = 1;   ///< scale of a normal map
  bool given() const { return !file.empty() || image >= 0; }
};

/// What is done to texture coordinates before a picture is looked up: (u, v) becomes rows times (u, v, 1).
struct UvTransform {
  V2f u{1, 0}, v{0, 1};
  V2f offset{0, 0};
  bool operator==(const UvTransform& o) const { return u == o.u && v == o.v && offset == o.offset; }
  V2f operator()(const V2f& p) const { return V2f(u.dot(p), v.dot(p)) + offset; }
};

/// A material as the model has it; which of the numbers count says `kind`.
struct ModelMaterial {
  enum Kind : uint8_t {
    metallic,  ///< glTF's metallic-roughness, and what is written like it (FBX, .mtl with Pr and Pm)
    specular,  ///< specular colour and glossiness
    phong,     ///< diffuse and specular colours and an exponent: .mtl, COLLADA, 3DS
    unlit      ///< a colour that needs no light
  };
  enum Alpha : uint8_t { opaque, mask, blend };

  std::string name;
  Kind kind = phong;
  Alpha alpha = opaque;
  bool two_sided = false;
  bool has_volume = false;  ///< transmission into a body, not through a thin sheet
  RGB base{0.8f};           ///< base or diffuse colour, linear
  RGB specular_color{0};    ///< of specular and phong
  RGB emission{0};          ///< times emission_strength
  float emission_strength = 1;
  float opacity = 1, alpha_cutoff = 0.5f;
  float metalness = 0, roughness = 1;  ///< of metallic; roughness is the square root of GGX's alpha
  float glossiness = 1;                ///< of specular
  float exponent = 0;                  ///< of phong
  float reflectivity = 0;              ///< of phong: mirrors
  float transmission = 0, ior = 1.5f;
  float specular_weight = 1;  ///< of metallic: of what a dielectric mirrors
  float clearcoat = 0, clearcoat_roughness = 0, anisotropy = 0;
  RGB sheen{0};
  float sheen_roughness = 0;
  RGB specular_tint{1};                                 ///< of metallic: of what a dielectric mirrors
  float film = 0, film_thickness = 0, film_ior = 1.3f;  ///< iridescence: share; nm
  float attenuation_distance = 0;  ///< of a volume, in the model's unit: light becomes attenuation_color; 0: never
  RGB attenuation_color{1};
  float dispersion = 0;      ///< of a volume: 20 over Abbe's number
  UvTransform uv_transform;  ///< of all its pictures; done to the coordinates of meshes already
  ModelTexture clearcoat_map, clearcoat_roughness_map;  ///< red, green
  ModelTexture clearcoat_normal_map;
  ModelTexture base_map, opacity_map, normal_map, bump_map, emission_map, transmission_map;
  ModelTexture metalness_map, roughness_map;  ///< blue and green, as in glTF, where they are one picture
  bool metal_rough_map = false;               ///< they are one
  std::vector<std::string> left_out;          ///< features that have no counterpart here
};

/// Triangles of one material. Lists by vertex are empty or as long as P.
struct ModelMesh {
  std::string name;
  uint32_t material = 0;
  std::vector<V3f> P, P_end, N;
  std::array<std::vector<V2f>, 4> uv;  ///< v = 0 is the lower edge of a picture
  std::vector<RGB> color;              ///< linear
  std::vector<int32_t> indices;        ///< 3 a triangle
};

/// A place of some meshes: columns of points, in the model's space, when the shutter opens and closes.
struct ModelNode {
  std::string name;
  M44d start, end;  ///< rows, as base::Transform has them
  std::vector<uint32_t> meshes;
};

struct ModelCamera {
  std::string name;
  V3d eye{0, 0, 0}, look{0, 0, -1}, up{0, 1, 0};
  V3d eye_end{0, 0, 0}, look_end{0, 0, -1}, up_end{0, 1, 0};
  double fov = 0;     ///< degrees, across the picture or up it
  double aspect = 0;  ///< width over height; 0: the model does not say
  bool fov_is_vertical = false;
};

struct ModelLight {
  enum Type : uint8_t { point, spot, distant, ambient, area };
  std::string name;
  Type type = point;
  bool physical = false;  ///< glTF's units: candela, and lux of a distant light
  RGB color{1};           ///< times the intensity
  V3d position{0, 0, 0}, direction{0, 0, -1}, up{0, 1, 0};
  float cone_inner = 0, cone_outer = 0;           ///< half angles, degrees
  float constant = 0, linear = 0, quadratic = 1;  ///< light falls off by their polynomial in distance
  float width = 0, height = 0;                    ///< of an area light
};

/// A picture inside of the model.
struct ModelImage {
  std::string name, extension;  ///< of an encoded one: "png"
  std::vector<uint8_t> bytes;   ///< a file, or RGBA if width is not 0
  uint32_t width = 0, height = 0;
};

/// What a model file holds, flat, and at one time (or two). Indices are in range, numbers finite, once check_model()
/// has passed.
struct Model {
  std::vector<ModelMaterial> materials;
  std::vector<ModelMesh> meshes;
  std::vector<ModelNode> nodes;
  std::vector<ModelCamera> cameras;
  std::vector<ModelLight> lights;
  std::vector<ModelImage> images;
  std::vector<std::string> left_out;  ///< what of the file is not here
  bool z_up = false;                  ///< else y is
  double metres = 0;                  ///< of one unit; 0: the file does not say
  uint8_t animations = 0;             ///< how many the file has, up to 255
  double duration = 0;                ///< seconds, of the longest
};

/// Box of all vertices at their places, when the shutter opens.
Imath::Box3d bounds_of(const Model& model);

/// Throws std::runtime_error, saying what is wrong, unless all counts, indices and numbers are in range.
void check_model(const Model& model);

}  // namespace dapple::modelfile
