// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/level_of_detail.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "dapple/build/object_views.h"
#include "dapple/build/openpbr_factory.h"
#include "dapple/vegetation/pruning_numbers.h"

namespace dapple::build {

using geom::DicingView;
using scenefile::ShapeEntity;

namespace {

constexpr float most_pixels = 64;

// The narrowest pixels of several views.
class NarrowestView final : public DicingView {
 public:
  explicit NarrowestView(std::vector<std::shared_ptr<const DicingView>> views) : views_(std::move(views)) {}

  void pixel_widths(std::span<const V3f> P, float* widths) const override {
    views_.front()->pixel_widths(P, widths);
    std::vector<float> others(P.size());
    for (size_t v = 1; v < views_.size(); ++v) {
      views_[v]->pixel_widths(P, others.data());
      for (size_t i = 0; i < others.size(); ++i) widths[i] = std::min(widths[i], others[i]);
    }
  }

 private:
  std::vector<std::shared_ptr<const DicingView>> views_;
};

std::shared_ptr<const DicingView> narrowest(std::vector<std::shared_ptr<const DicingView>> views) {
  if (views.size() == 1) return views.front();
  return std::make_shared<NarrowestView>(std::move(views));
}

}  // namespace

std::optional<float> level_of_detail(std::string_view text) {
  if (text == "off") return 0.0f;
  if (text == "auto") return vegetation::PruningNumbers::pixels;
  float pixels = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pixels);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  return is_number && pixels > 0 && pixels <= most_pixels ? std::optional(pixels) : std::nullopt;
}

float scene_level_of_detail(const BuildContext& context) {
  const auto& options = context.description.options;
  if (!options.find("lod")) return 0;
  const std::string text = options.get_string("lod", "off");
  if (const auto pixels = level_of_detail(text)) return *pixels;
  throw InputError(options.find("lod")->loc, "Option \"lod\" is \"" + text + "\"; " + expected_level_of_detail);
}

LevelOfDetail::LevelOfDetail(const BuildContext& context, const scene::Scene& scene, const scene::Camera& dicing_camera,
                             float pixels)
    : context_(context), pixels_(pixels) {
  if (!(pixels_ > 0)) return;
  // Once, as look-ups in parameters are not for several threads and shapes share materials.
  for (size_t m = 0; m < context.description.materials.size(); ++m) {
    const auto& entity = context.description.materials[m];
    stays_.push_back(emission_of(entity) || has_interior(entity) || scene.materials[m]->is_interface());
  }
  cameras_.push_back(std::make_shared<CameraView>(dicing_camera));
  if (dicing_camera.settings().camera_to_world.is_animated()) {
    scene::Camera::Settings at_close = dicing_camera.settings();
    const Transform last = at_close.camera_to_world.at(double(at_close.time_close));
    at_close.camera_to_world = AnimatedTransform(last, last);
    cameras_.push_back(std::make_shared<CameraView>(scene::Camera(at_close)));
  }
  world_ = narrowest({cameras_.begin(), cameras_.end()});

  const auto wanted = [this](const ShapeEntity& e) { return may_be_pruned(e); };
  object_views_ = object_views(context, cameras_.front(), wanted, MotionEnds::both);
  if (cameras_.size() == 1) return;
  const auto at_close = object_views(context, cameras_.back(), wanted, MotionEnds::both);
  for (size_t i = 0; i < at_close.size(); ++i)
    if (at_close[i]) object_views_[i] = narrowest({object_views_[i], at_close[i]});
}

bool LevelOfDetail::may_be_pruned(const ShapeEntity& e) const {
  if (!e.type.ends_with("mesh") || !e.is_shown() || !e.params.get_bool("lod", true)) return false;
  return e.area_light < 0 && !stays_[size_t(e.material)] && e.inside_medium == e.outside_medium;
}

std::shared_ptr<const DicingView> LevelOfDetail::view_of(const ShapeEntity& e, std::optional<size_t> object) const {
  if (!(pixels_ > 0) || !may_be_pruned(e)) return nullptr;
  return object ? object_views_[*object] : world_;
}

std::shared_ptr<const DicingView> LevelOfDetail::view_of(const ShapeEntity& e,
                                                         const scenefile::TransformPair& motion) const {
  if (!(pixels_ > 0) || !may_be_pruned(e)) return nullptr;
  std::vector<std::shared_ptr<const DicingView>> views;
  for (const auto& camera : cameras_)
    views.push_back(std::make_shared<InstancesView>(camera, std::vector{motion.start, motion.end}, Box3f()));
  return narrowest(std::move(views));
}

}  // namespace dapple::build
