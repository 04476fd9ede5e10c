// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/cache_colors.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace dapple::render {

namespace {

constexpr float most_fills = 64, best_reuse = 1024;

// Luminance rises evenly to the eye, so that the ramp is read in grey as well.
RGB ramp(float t) {
  constexpr RGB stops[] = {
      {.004f, .004f, .05f}, {.06f, .01f, .2f}, {.36f, .03f, .14f}, {.85f, .22f, .02f}, {1, .95f, .5f}};
  constexpr int last = int(std::size(stops)) - 1;
  const float x = std::clamp(t, 0.0f, 1.0f) * float(last);
  const int i = std::min(int(x), last - 1);
  return stops[i] + (stops[i + 1] - stops[i]) * (x - float(i));
}

}  // namespace

RGB cache_color(CacheView view, const scene::CacheFeatures& use) {
  if (view == CacheView::level)
    return RGB(.03f, .15f, 1) * use.coarse + RGB(.05f, .6f, .05f) * use.medium + RGB(1, .05f, .02f) * use.fine +
           RGB(1) * use.shaded;
  if (!(use.fills > 0)) return RGB(.1f);
  if (view == CacheView::age) return ramp(1 - use.age);
  if (view == CacheView::fills) return ramp(std::log2(use.fills) / std::log2(most_fills));
  return ramp(1 - std::log2(use.reuse) / std::log2(best_reuse));
}

}  // namespace dapple::render
