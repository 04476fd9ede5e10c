// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/dicing.h"

#include <algorithm>
#include <optional>
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

namespace {

class CagePlan final : public DicePlan {
 public:
  CagePlan(const BuildContext& context, const ShapeEntity& e, geom::ControlCage cage, const Dicing& dicing,
           const geom::DiceSettings& settings, const pattern::FloatTexturePtr& texture)
      : context_(context), entity_(e), settings_(settings), displacer_(texture) {
    if (texture && texture->constant() != 0.0f) settings_.displacement.displacer = &displacer_;
    const geom::UniformDicingView coarse(infinity);
    try {
      surface_ = geom::make_patch_surface(std::move(cage));
      rates_.emplace(*surface_, dicing.view ? *dicing.view : coarse, settings_.shading_rate, settings_.max_vertices);
    } catch (const std::invalid_argument& error) {
      throw InputError(e.loc, error.what());
    }
    least_ = rates_->coarsened;
    if (least_ > 0)
      context.diagnostics.warn(
          e.loc, "shape \"" + e.type + "\": diced " + std::to_string(1 << least_) +
                     " times more coarsely along each side than \"shadingrate\" asks for, to have at most " +
                     std::to_string(settings_.max_vertices >> 20) + " million vertices");
  }

  size_t coarsen(int levels) override {
    rates_->coarsen(surface_->topology(), std::min(least_ + levels, geom::DiceRates::max_level));
    return rates_->vertex_count();
  }

  trace::GridsPtr dice() override {
    geom::DiceReport report;
    std::shared_ptr<const geom::GridMesh> mesh;
    try {
      mesh = std::make_shared<const geom::GridMesh>(geom::dice(*surface_, *rates_, settings_.displacement, &report));
    } catch (const std::invalid_argument& error) {
      throw InputError(entity_.loc, error.what());
    }
    if (report.clamped > 0)
      context_.diagnostics.warn(
          entity_.loc,
          "shape \"" + entity_.type + "\": " + std::to_string(report.clamped) +
              " points would be displaced by more than \"displacementbound\", or by no number; they were held back");
    if (mesh->grids.empty()) return nullptr;
    return mesh;
  }

 private:
  const BuildContext& context_;
  const ShapeEntity& entity_;
  geom::DiceSettings settings_;
  const TextureDisplacer displacer_;
  std::unique_ptr<geom::PatchSurface> surface_;
  std::optional<geom::DiceRates> rates_;
  int least_ = 0;  // levels that the shape alone needs taken off
};

}  // namespace

std::unique_ptr<DicePlan> plan_cage(const BuildContext& context, const ShapeEntity& e, geom::ControlCage cage,
                                    const Dicing& dicing) {
  geom::DiceSettings settings;
  settings.shading_rate = e.params.get_float("shadingrate", dicing.shading_rate);
  if (!(settings.shading_rate > 0))
    throw InputError(e.loc, "\"shadingrate\" is " + std::to_string(settings.shading_rate) + "; it must be above 0");
  settings.displacement.bound = e.params.get_float("displacementbound", infinity);
  if (settings.displacement.bound < 0) throw InputError(e.loc, "\"displacementbound\" is negative");
  pattern::FloatTexturePtr texture =
      dicing.textures ? dicing.textures->optional_float_texture(e.params, "displacement") : nullptr;
  if (dicing.shader) texture = std::make_shared<shading::DisplacementTexture>(dicing.shader, texture);

  for (const auto* list : {&cage.P, &cage.P_end})
    for (const V3f& p : *list)
      if (!is_finite(p)) throw InputError(e.loc, "a vertex is not finite after its transform");
  for (const std::string& flaw : cage.clean()) context.diagnostics.warn(e.loc, "shape \"" + e.type + "\": " + flaw);
  if (cage.face_count() == 0) return nullptr;
  if (cage.scheme == geom::SurfaceScheme::polygons) cage.split(most_split_faces);
  return std::make_unique<CagePlan>(context, e, std::move(cage), dicing, settings, texture);
}

int fit_plans(const std::vector<std::unique_ptr<DicePlan>>& plans, size_t most_vertices, size_t* first) {
  std::vector<size_t> counts(plans.size());
  size_t all = 0, number = 0;
  for (size_t i = 0; i < plans.size(); ++i)
    if (plans[i]) all += counts[i] = plans[i]->coarsen(0), ++number;
  if (all <= most_vertices) return 0;
  const size_t share = most_vertices / number;
  *first = size_t(std::find_if(counts.begin(), counts.end(), [share](size_t n) { return n > share; }) - counts.begin());
  int levels = 0;
  while (all > most_vertices && levels < geom::DiceRates::max_level) {
    ++levels;
    all = 0;
    for (size_t i = 0; i < plans.size(); ++i) all += counts[i] > share ? plans[i]->coarsen(levels) : counts[i];
  }
  return levels;
}

}  // namespace dapple::build
