// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/dicing.h"

#include <stdexcept>

#include "dapple/build/texture_displacer.h"
#include "dapple/geom/dicer.h"
#include "dapple/shading/displacement_texture.h"

namespace dapple::build {

using scenefile::ShapeEntity;

namespace {

constexpr size_t most_split_faces = 1024;

}  // namespace

bool is_displaced(const ShapeEntity& e, const Dicing& dicing) {
  return dicing.textures && (e.params.find("displacement") || dicing.shader);
}

trace::GridsPtr dice_cage(const BuildContext& context, const ShapeEntity& e, geom::ControlCage cage,
                          const Dicing& dicing) {
  geom::DiceSettings settings;
  settings.shading_rate = e.params.get_float("shadingrate", dicing.shading_rate);
  if (!(settings.shading_rate > 0))
    throw InputError(e.loc, "\"shadingrate\" is " + std::to_string(settings.shading_rate) + "; it must be above 0");
  settings.displacement.bound = e.params.get_float("displacementbound", infinity);
  if (settings.displacement.bound < 0) throw InputError(e.loc, "\"displacementbound\" is negative");
  shading::FloatTexturePtr texture =
      dicing.textures ? dicing.textures->optional_float_texture(e.params, "displacement") : nullptr;
  if (dicing.shader) texture = std::make_shared<shading::DisplacementTexture>(dicing.shader, texture);
  const TextureDisplacer displacer(texture);
  if (texture && texture->constant() != 0.0f) settings.displacement.displacer = &displacer;

  const std::string shape = "shape \"" + e.type + "\": ";
  for (const auto* list : {&cage.P, &cage.P_end})
    for (const V3f& p : *list)
      if (!is_finite(p)) throw InputError(e.loc, "a vertex is not finite after its transform");
  for (const std::string& flaw : cage.clean()) context.diagnostics.warn(e.loc, shape + flaw);
  if (cage.face_count() == 0) return nullptr;
  if (cage.scheme == geom::SurfaceScheme::polygons) cage.split(most_split_faces);
  const geom::UniformDicingView coarse(infinity);
  geom::DiceReport report;
  std::shared_ptr<const geom::GridMesh> mesh;
  try {
    const auto surface = geom::make_patch_surface(std::move(cage));
    mesh = std::make_shared<const geom::GridMesh>(
        geom::dice(*surface, dicing.view ? *dicing.view : coarse, settings, &report));
  } catch (const std::invalid_argument& error) {
    throw InputError(e.loc, error.what());
  }
  if (report.clamped > 0)
    context.diagnostics.warn(
        e.loc,
        shape + std::to_string(report.clamped) +
            " points would be displaced by more than \"displacementbound\", or by no number; they were held back");
  if (report.coarsened > 0)
    context.diagnostics.warn(
        e.loc, shape + "diced " + std::to_string(1 << report.coarsened) +
                   " times more coarsely along each side than \"shadingrate\" asks for, to have at most " +
                   std::to_string(settings.max_vertices >> 20) + " million vertices");
  if (mesh->grids.empty()) return nullptr;
  return mesh;
}

}  // namespace dapple::build
