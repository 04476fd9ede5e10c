// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "dapple/modelfile/assimp_reader.h"

namespace dapple::modelfile {

namespace {

float degrees(float radians) {
  return std::isfinite(radians) && radians > 0 ? std::min(radians * 180 / pi, 90.0f) : 0;
}

float factor(float x) {
  return std::isfinite(x) && x > 0 ? x : 0;
}

}  // namespace

void convert_lights(const aiScene& scene, bool is_gltf, Model* model) {
  for (unsigned i = 0; i < scene.mNumLights; ++i) {
    const aiLight& l = *scene.mLights[i];
    ModelLight out;
    out.name = l.mName.C_Str();
    out.physical = is_gltf;
    out.color = to_rgb(l.mType == aiLightSource_AMBIENT ? l.mColorAmbient : l.mColorDiffuse);
    out.position = to_v3d(l.mPosition);
    out.direction = to_v3d(l.mDirection);
    if (!(out.direction.length() > 0)) out.direction = V3d(0, 0, -1);
    out.up = to_v3d(l.mUp);
    if (!(out.up.length() > 0)) out.up = V3d(0, 1, 0);
    out.constant = factor(l.mAttenuationConstant);
    out.linear = factor(l.mAttenuationLinear);
    out.quadratic = factor(l.mAttenuationQuadratic);
    switch (l.mType) {
      case aiLightSource_POINT:
        out.type = ModelLight::point;
        break;
      case aiLightSource_SPOT:
        out.type = ModelLight::spot;
        // Half angles in glTF, whole ones elsewhere.
        out.cone_inner = degrees(l.mAngleInnerCone) * (is_gltf ? 1.0f : 0.5f);
        out.cone_outer = degrees(l.mAngleOuterCone) * (is_gltf ? 1.0f : 0.5f);
        break;
      case aiLightSource_DIRECTIONAL:
        out.type = ModelLight::distant;
        break;
      case aiLightSource_AMBIENT:
        out.type = ModelLight::ambient;
        break;
      case aiLightSource_AREA:
        out.type = ModelLight::area;
        out.width = factor(l.mSize.x), out.height = factor(l.mSize.y);
        break;
      default:
        model->left_out.push_back("light \"" + out.name + "\" of an unknown kind");
        continue;
    }
    if (out.color.max() > 0) model->lights.push_back(std::move(out));
  }
}

}  // namespace dapple::modelfile
