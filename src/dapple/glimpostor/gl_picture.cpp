// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/gl_picture.h"

#include "dapple/glimpostor/egl_context.h"
#include "dapple/glimpostor/frame_target.h"
#include "dapple/glimpostor/point_drawer.h"
#include "dapple/glimpostor/slice_passes.h"

namespace dapple::glimpostor {

using depthimage::ObjectPicture;
using depthimage::SampleMask;
using depthimage::ScreenMap;
using depthimage::SplatLevel;
using depthimage::SplatObject;
using depthimage::SplatTile;
using impostor::SubSamples;

namespace {

constexpr int region_side = 128;

class Painter {
 public:
  Painter(const SplatObject& object, int level, const ScreenMap& camera, const V2i& resolution,
          const GlPictureSettings& settings)
      : object_(object), level_(object.levels[size_t(level)]), settings_(settings) {
    draw_.object = &object, draw_.level = level, draw_.map = camera;
    picture_.width = resolution.x, picture_.height = resolution.y;
    picture_.color.resize(size_t(resolution.x) * size_t(resolution.y));
    picture_.alpha.resize(picture_.color.size());
    list_.object = &object, list_.level = level, list_.draws = {0};
    for (uint32_t c = 0; c < level_.chunks.size(); ++c) {
      const V3f& w = object.frames[level_.chunks[c].view].w;
      if (!object.one_sided || camera.apply_vector(ScreenMap::Z, w) < 0) list_.chunks.push_back({0, c});
    }
    const float middle = camera.apply(ScreenMap::Z, object.centre),
                reach = 1.1f * object.radius * std::sqrt(3.0f) *
                        length(V3f(camera.m[3][0], camera.m[3][1], camera.m[3][2]));
    region_.nearest = middle - reach, region_.farthest = middle + reach;
    region_.perspective = camera.is_perspective();
  }

  ObjectPicture paint() {
    for (int y = 0; y < picture_.height; y += region_side)
      for (int x = 0; x < picture_.width; x += region_side) {
        region_.pixels = Box2i(
            V2i(x, y), V2i(std::min(x + region_side, picture_.width), std::min(y + region_side, picture_.height)));
        settings_.path == GlPath::slices&& settings_.two_passes ? paint_passes() : paint_shown();
      }
    check_gl("drawing");
    return std::move(picture_);
  }

 private:
  template <typename Value>
  void add_sub_samples(const Value& value) {
    const V2i size = (region_.pixels.max - region_.pixels.min) * SampleMask::side;
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        RGB color;
        float cover = 0;
        value(size_t(y) * size_t(size.x) + size_t(x), &color, &cover);
        const V2i at = region_.pixels.min + V2i(x, y) / SampleMask::side;
        const size_t pixel = size_t(at.y) * size_t(picture_.width) + size_t(at.x);
        picture_.color[pixel] += color * (1.0f / SampleMask::count);
        picture_.alpha[pixel] += cover / SampleMask::count;
      }
  }

  void paint_passes() {
    if (!passes_) passes_ = std::make_unique<SlicePasses>(region_side * SampleMask::side);
    const ColorMatrix shading = ColorMatrix::shading(settings_.to_light.value_or(V3f(0, 0, 1)));
    float largest = 0;
    std::vector<float> rgba;
    passes_->draw({&draw_, 1}, list_, region_, settings_.to_light ? &shading : nullptr, &rgba, &largest);
    add_sub_samples([&](size_t i, RGB* color, float* cover) {
      *color = RGB(rgba[4 * i], rgba[4 * i + 1], rgba[4 * i + 2]) * largest;
      *cover = rgba[4 * i + 3];
    });
  }

  void paint_shown() {
    if (!target_) {
      target_ = std::make_unique<FrameTarget>(region_side * SampleMask::side);
      if (settings_.path == GlPath::slices)
        drawer_ = std::make_unique<SliceDrawer>();
      else
        drawer_ = std::make_unique<PointDrawer>();
    }
    SubSamples shown;
    shown.pixels = region_.pixels;
    const size_t count = shown.width() * size_t(region_.pixels.max.y - region_.pixels.min.y) * SampleMask::side;
    shown.draw.resize(count), shown.fragment.resize(count), shown.depth.resize(count);
    target_->begin(region_.pixels);
    drawer_->draw({&draw_, 1}, list_, region_);
    target_->read(region_.pixels, &shown);
    const V3f to_viewer = ViewOfObject(draw_.map, object_.centre).to_viewer;
    add_sub_samples([&](size_t i, RGB* color, float* cover) {
      if (shown.draw[i] == SubSamples::none) return;
      const uint32_t view = level_.chunks[shown.fragment[i] / uint32_t(SplatLevel::chunk_size)].view;
      const SplatObject::Surface s = object_.surface(level_, view, shown.fragment[i]);
      *color = s.reflectance + s.transmittance;
      *cover = 1;
      const V3f side = settings_.path == GlPath::slices ? object_.frames[view].w : to_viewer;
      if (settings_.to_light) *color *= std::max(0.0f, dot(face_forward(s.normal, side), *settings_.to_light));
    });
  }

  const SplatObject& object_;
  const SplatLevel& level_;
  const GlPictureSettings& settings_;
  SplatTile::Draw draw_;
  DrawList list_;
  Region region_;
  ObjectPicture picture_;
  std::unique_ptr<SlicePasses> passes_;
  std::unique_ptr<FrameTarget> target_;
  std::unique_ptr<Drawer> drawer_;
};

}  // namespace

std::optional<ObjectPicture> gl_picture(const SplatObject& object, int level, const ScreenMap& camera,
                                        const V2i& resolution, const GlPictureSettings& settings, std::string* why) {
  const auto context = EglContext::open(why);
  if (!context) return std::nullopt;
  const EglContext::Current current(*context);
  try {
    return Painter(object, level, camera, resolution, settings).paint();
  } catch (const GlError& problem) {
    *why = problem.what();
    return std::nullopt;
  }
}

}  // namespace dapple::glimpostor
