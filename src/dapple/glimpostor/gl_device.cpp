// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/gl_device.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <tuple>

#include "dapple/base/timer.h"
#include "dapple/glimpostor/egl_context.h"
#include "dapple/glimpostor/frame_target.h"
#include "dapple/glimpostor/point_drawer.h"
#include "dapple/glimpostor/slice_drawer.h"

namespace dapple::glimpostor {

using depthimage::SampleMask;
using depthimage::SplatLevel;
using depthimage::SplatTile;
using impostor::ImageView;
using impostor::SubSamples;

namespace {

constexpr int slice_resolution = 128;             // 8 bits of depth are too few for more
constexpr int slice_views = 14;                   // from 6, leaves seen from aside are a tenth too narrow
constexpr int region_side = 8 * SplatTile::side;  // pixels drawn at once

// What an object's level is drawn of: lists of matrices, so that its textures are bound once.
std::vector<DrawList> lists_of(const ImageView& view, const Box2i& pixels, float* nearest, float* farthest) {
  std::vector<std::pair<uint32_t, uint32_t>> work;  // draw, chunk
  *nearest = infinity, *farthest = 0;
  constexpr int side = SplatTile::side;
  for (int y = pixels.min.y / side; y * side < pixels.max.y; ++y)
    for (int x = pixels.min.x / side; x * side < pixels.max.x; ++x)
      for (const ImageView::Work& w : view.work_of(V2i(x, y))) {
        *nearest = std::min(*nearest, w.nearest), *farthest = std::max(*farthest, w.nearest);
        if (w.chunk != ImageView::Work::all_chunks) {
          work.emplace_back(w.draw, w.chunk);
          continue;
        }
        const SplatTile::Draw& draw = view.draws()[w.draw];
        const auto chunks = uint32_t(draw.object->levels[size_t(draw.level)].chunks.size());
        for (uint32_t c = 0; c < chunks; ++c) work.emplace_back(w.draw, c);
      }
  std::sort(work.begin(), work.end());
  work.erase(std::unique(work.begin(), work.end()), work.end());
  std::map<std::pair<const depthimage::SplatObject*, int>, size_t> places;
  std::vector<DrawList> out;
  for (const auto& [number, chunk] : work) {
    const SplatTile::Draw& draw = view.draws()[number];
    const auto [place, is_new] = places.try_emplace({draw.object, draw.level}, out.size());
    if (is_new) out.push_back({draw.object, draw.level, {}, {}});
    DrawList& list = out[place->second];
    if (list.draws.empty() || list.draws.back() != number) list.draws.push_back(number);
    list.chunks.push_back({uint32_t(list.draws.size() - 1), chunk});
  }
  return out;
}

class Device final : public impostor::ProjectionDevice {
 public:
  Device(std::unique_ptr<EglContext> context, GlPath path) : context_(std::move(context)), path_(path) {
    const EglContext::Current current(*context_);
    target_ = std::make_unique<FrameTarget>(region_side * SampleMask::side);
    drawer_ = make_drawer(path);
    check_gl("opening");
  }
  ~Device() override {
    const EglContext::Current current(*context_);
    drawer_.reset();
    target_.reset();
  }

  void project(const ImageView& view, const Box2i& pixels, const V2f& jitter, uint32_t round,
               SubSamples* out) override {
    const std::lock_guard lock(mutex_);
    const EglContext::Current current(*context_);
    const Timer timer;
    out->pixels = pixels;
    const size_t count = out->width() * size_t(pixels.max.y - pixels.min.y) * SampleMask::side;
    out->draw.assign(count, SubSamples::none);
    out->fragment.assign(count, 0);
    out->depth.assign(count, infinity);
    for (int y = pixels.min.y; y < pixels.max.y; y += region_side)
      for (int x = pixels.min.x; x < pixels.max.x; x += region_side)
        draw_region(
            view,
            Box2i(V2i(x, y), V2i(std::min(x + region_side, pixels.max.x), std::min(y + region_side, pixels.max.y))),
            jitter, round, out);
    counts_.seconds += timer.seconds();
  }

  Counts counts() const override {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  static std::unique_ptr<Drawer> make_drawer(GlPath path) {
    if (path == GlPath::slices) return std::make_unique<SliceDrawer>();
    return std::make_unique<PointDrawer>();
  }

  void draw_region(const ImageView& view, const Box2i& pixels, const V2f& jitter, uint32_t round, SubSamples* out) {
    Region region;
    region.pixels = pixels, region.jitter = jitter, region.round = round;
    const std::vector<DrawList> lists = lists_of(view, pixels, &region.nearest, &region.farthest);
    if (lists.empty()) return;
    region.perspective = view.is_perspective();
    target_->begin(pixels);
    for (const DrawList& list : lists) {
      drawer_->draw(view.draws(), list, region);
      ++counts_.draw_calls;
    }
    counts_.binds = drawer_->binds(), counts_.bytes = drawer_->bytes();
    target_->read(pixels, out);
    check_gl("drawing");
  }

  std::unique_ptr<EglContext> context_;
  const GlPath path_;
  mutable std::mutex mutex_;
  std::unique_ptr<FrameTarget> target_;
  std::unique_ptr<Drawer> drawer_;
  Counts counts_;
};

}  // namespace

impostor::BakeSettings bake_settings(GlPath path) {
  impostor::BakeSettings s;
  if (path == GlPath::slices)
    s.resolution = slice_resolution, s.views = slice_views, s.layers = SliceTextures::most_layers;
  return s;
}

std::shared_ptr<impostor::ProjectionDevice> open_device(GlPath path, std::string* renderer, std::string* why) {
  auto context = EglContext::open(why);
  if (!context) return nullptr;
  *renderer = context->renderer();
  try {
    return std::make_shared<Device>(std::move(context), path);
  } catch (const GlError& problem) {
    *why = problem.what();
    return nullptr;
  }
}

}  // namespace dapple::glimpostor
