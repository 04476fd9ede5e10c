// SPDX-License-Identifier: Apache-2.0
#include <assimp/GltfMaterial.h>
#include <assimp/ObjMaterial.h>
#include <assimp/material.h>

#include <cstdlib>

#include "dapple/modelfile/assimp_reader.h"

namespace dapple::modelfile {

namespace {

class MaterialReader {
 public:
  MaterialReader(const aiMaterial& m, const aiScene& scene, bool is_gltf) : m_(m), scene_(scene), is_gltf_(is_gltf) {}

  ModelMaterial read() {
    aiString name;
    if (m_.Get(AI_MATKEY_NAME, name) == AI_SUCCESS) out_.name = name.C_Str();
    int two_sided = 0;
    out_.two_sided = m_.Get(AI_MATKEY_TWOSIDED, two_sided) == AI_SUCCESS && two_sided != 0;
    read_base();
    read_kind();
    read_alpha();
    read_emission();
    read_transmission();
    read_surface_maps();
    read_layers();
    return std::move(out_);
  }

 private:
  bool number(const char* key, unsigned type, unsigned index, float* value) const {
    ai_real x = 0;
    if (m_.Get(key, type, index, x) != AI_SUCCESS || !std::isfinite(x)) return false;
    *value = std::clamp(float(x), -1e6f, 1e6f);
    return true;
  }
  bool color(const char* key, unsigned type, unsigned index, RGB* value, float* alpha = nullptr) const {
    aiColor4D c(0, 0, 0, 1);
    if (m_.Get(key, type, index, c) != AI_SUCCESS) return false;
    *value = to_rgb(aiColor3D(c.r, c.g, c.b));
    if (alpha && std::isfinite(c.a)) *alpha = std::clamp(float(c.a), 0.0f, 1.0f);
    return true;
  }
  bool map(aiTextureType type, unsigned index, ModelTexture* out) const {
    aiString file;
    unsigned set = 0;
    aiTextureMapMode modes[3] = {aiTextureMapMode_Wrap, aiTextureMapMode_Wrap, aiTextureMapMode_Wrap};
    if (m_.GetTexture(type, index, &file, nullptr, &set, nullptr, nullptr, modes) != AI_SUCCESS) return false;
    if (file.length == 0) return false;
    *out = ModelTexture();
    out->uv_set = std::min(set, 3u);
    out->wrap = modes[0] == aiTextureMapMode_Clamp || modes[0] == aiTextureMapMode_Decal ? 1
                : modes[0] == aiTextureMapMode_Mirror                                    ? 2
                                                                                         : 0;
    const auto [texture, at] = scene_.GetEmbeddedTextureAndIndex(file.C_Str());
    if (texture && at >= 0) {
      out->image = at;
      return true;
    }
    out->file = file.C_Str();
    return out->file[0] != '*';
  }

  void read_base() {
    float alpha = 1;
    if (!color(AI_MATKEY_BASE_COLOR, &out_.base, &alpha)) color(AI_MATKEY_COLOR_DIFFUSE, &out_.base, &alpha);
    if (is_gltf_) out_.opacity = alpha;
    if (!map(aiTextureType_BASE_COLOR, 0, &out_.base_map)) map(aiTextureType_DIFFUSE, 0, &out_.base_map);
    // Exporters that write a picture often leave the colour that it replaces black.
    if (!is_gltf_ && out_.base_map.given() && out_.base.max() == 0) out_.base = RGB(1);
    color(AI_MATKEY_COLOR_SPECULAR, &out_.specular_color);
  }

  void read_kind() {
    int mode = 0;
    const bool has_mode = m_.Get(AI_MATKEY_SHADING_MODEL, mode) == AI_SUCCESS;
    const bool metal = number(AI_MATKEY_METALLIC_FACTOR, &out_.metalness),
               rough = number(AI_MATKEY_ROUGHNESS_FACTOR, &out_.roughness);
    if (has_mode && mode == aiShadingMode_NoShading && is_gltf_) {
      out_.kind = ModelMaterial::unlit;
    } else if (number(AI_MATKEY_GLOSSINESS_FACTOR, &out_.glossiness)) {
      out_.kind = ModelMaterial::specular;
      color(AI_MATKEY_COLOR_DIFFUSE, &out_.base, is_gltf_ ? &out_.opacity : nullptr);
      map(aiTextureType_DIFFUSE, 0, &out_.base_map);
    } else if (is_gltf_ || metal || rough) {
      out_.kind = ModelMaterial::metallic;
    } else {
      out_.kind = ModelMaterial::phong;
      read_illumination(has_mode ? mode : 0);
      number(AI_MATKEY_SHININESS, &out_.exponent);
      float strength = 1;
      if (number(AI_MATKEY_SHININESS_STRENGTH, &strength)) out_.specular_color *= std::clamp(strength, 0.0f, 1.0f);
      number(AI_MATKEY_REFLECTIVITY, &out_.reflectivity);
      if (RGB mirrored; color(AI_MATKEY_COLOR_REFLECTIVE, &mirrored))
        out_.reflectivity *= std::min(mirrored.max(), 1.0f);
    }
  }

  // The models of light of .mtl: 1 has no highlight, 4, 6, 7 and 9 are glass.
  void read_illumination(int mode) {
    int illum = 0;
    if (m_.Get(AI_MATKEY_OBJ_ILLUM, illum) != AI_SUCCESS) {
      if (mode == aiShadingMode_Gouraud) out_.specular_color = RGB(0);
    } else if (illum <= 1) {
      out_.specular_color = RGB(0);
    } else if (illum == 4 || illum == 6 || illum == 7 || illum == 9) {
      out_.transmission = 1, out_.has_volume = true;
    }
  }

  void read_alpha() {
    aiString mode;
    if (m_.Get(AI_MATKEY_GLTF_ALPHAMODE, mode) == AI_SUCCESS) {
      const std::string text = mode.C_Str();
      out_.alpha = text == "MASK"    ? ModelMaterial::mask
                   : text == "BLEND" ? ModelMaterial::blend
                                     : ModelMaterial::opaque;
      number(AI_MATKEY_GLTF_ALPHACUTOFF, &out_.alpha_cutoff);
      if (out_.alpha == ModelMaterial::opaque) out_.opacity = 1;
      return;
    }
    if (out_.transmission > 0) return;  // glass of .mtl: "d" says that one sees through it
    number(AI_MATKEY_OPACITY, &out_.opacity);
    out_.opacity = std::clamp(out_.opacity, 0.0f, 1.0f);
    map(aiTextureType_OPACITY, 0, &out_.opacity_map);
    if (out_.opacity < 1 || out_.opacity_map.given()) out_.alpha = ModelMaterial::blend;
  }

  void read_emission() {
    color(AI_MATKEY_COLOR_EMISSIVE, &out_.emission);
    if (!map(aiTextureType_EMISSIVE, 0, &out_.emission_map)) map(aiTextureType_EMISSION_COLOR, 0, &out_.emission_map);
    number(AI_MATKEY_EMISSIVE_INTENSITY, &out_.emission_strength);
    if (!is_gltf_ && out_.emission_map.given() && out_.emission.max() == 0) out_.emission = RGB(1);
  }

  void read_transmission() {
    number(AI_MATKEY_TRANSMISSION_FACTOR, &out_.transmission);
    map(aiTextureType_TRANSMISSION, 0, &out_.transmission_map);
    float thickness = 0;
    if (number(AI_MATKEY_VOLUME_THICKNESS_FACTOR, &thickness) && thickness > 0) out_.has_volume = true;
    float ior = 0;
    if (number(AI_MATKEY_REFRACTI, &ior) && ior > 1 && ior < 10) out_.ior = ior;
  }

  void read_surface_maps() {
    if (map(aiTextureType_NORMALS, 0, &out_.normal_map)) {
      number(AI_MATKEY_GLTF_TEXTURE_SCALE(aiTextureType_NORMALS, 0), &out_.normal_map.strength);
    } else {
      map(aiTextureType_NORMAL_CAMERA, 0, &out_.normal_map);
    }
    map(aiTextureType_HEIGHT, 0, &out_.bump_map);
    if (map(aiTextureType_UNKNOWN, 0, &out_.metalness_map) && is_gltf_) {
      out_.roughness_map = out_.metalness_map;
      out_.metal_rough_map = true;
      return;
    }
    out_.metalness_map = ModelTexture();
    map(aiTextureType_METALNESS, 0, &out_.metalness_map);
    map(aiTextureType_DIFFUSE_ROUGHNESS, 0, &out_.roughness_map);
  }

  // glTF's extensions of metallic-roughness.
  void read_layers() {
    number(AI_MATKEY_CLEARCOAT_FACTOR, &out_.clearcoat);
    number(AI_MATKEY_CLEARCOAT_ROUGHNESS_FACTOR, &out_.clearcoat_roughness);
    map(aiTextureType_CLEARCOAT, 0, &out_.clearcoat_map);
    map(aiTextureType_CLEARCOAT, 1, &out_.clearcoat_roughness_map);
    map(aiTextureType_CLEARCOAT, 2, &out_.clearcoat_normal_map);
    ModelTexture unused;
    number(AI_MATKEY_ANISOTROPY_FACTOR, &out_.anisotropy);
    color(AI_MATKEY_SHEEN_COLOR_FACTOR, &out_.sheen);
    number(AI_MATKEY_SHEEN_ROUGHNESS_FACTOR, &out_.sheen_roughness);
    if (out_.sheen.max() > 0 && (map(aiTextureType_SHEEN, 0, &unused) || map(aiTextureType_SHEEN, 1, &unused)))
      out_.left_out.push_back("pictures of sheen");
    if (is_gltf_ && out_.kind == ModelMaterial::metallic) number(AI_MATKEY_SPECULAR_FACTOR, &out_.specular_weight);
  }

  const aiMaterial& m_;
  const aiScene& scene_;
  const bool is_gltf_;
  ModelMaterial out_;
};

}  // namespace

ModelMaterial convert_material(const aiMaterial& material, const aiScene& scene, bool is_gltf) {
  return MaterialReader(material, scene, is_gltf).read();
}

}  // namespace dapple::modelfile
