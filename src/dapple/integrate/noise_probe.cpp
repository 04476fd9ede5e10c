// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/noise_probe.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/base/pool.h"
#include "dapple/numeric/sobol.h"

namespace dapple::integrate {

NoiseProbe::NoiseProbe(const scene::Film::Settings& film, int pixel_samples)
    : film_(film), pixel_samples_(uint32_t(pixel_samples)) {
  film_.features = film_.cache_use = film_.air = film_.direct = film_.halves = false;
  film_.light_groups = 0;
  const V2i size = film.resolution;
  if (size.x < box_side || size.y < box_side) return;
  const double image = double(size.x) * size.y * pixel_samples;
  const int count = int(std::min(image / image_samples, double(most_boxes)));
  constexpr uint32_t set = 0x6e6f6973;  // of all that random numbers are for
  for (int i = 0; i < count; ++i) {
    const V2f at = sample_2d(set, uint32_t(i), 0);
    const V2i corner(int(at.x * float(size.x - box_side + 1)), int(at.y * float(size.y - box_side + 1)));
    boxes_.push_back({corner, corner + V2i(box_side, box_side)});
  }
}

std::vector<NoiseProbe::Box> NoiseProbe::look(const Integrator& integrator, StopToken stop) const {
  std::vector<Box> found(boxes_.size());
  Pool<Integrator::Workspace> pool;
  parallel_for(boxes_.size(), [&](size_t i) {
    stop.check();
    const Box2i& box = boxes_[i];
    scene::Film::Settings of_box = film_;
    of_box.crop = box;
    scene::Film film(of_box);
    auto workspace = pool.take([&] { return integrator.make_workspace(); });
    integrator.render({box, 0, samples, pixel_samples_, stop}, *workspace, film);
    pool.give(std::move(workspace));
    constexpr double part = 1.0 / (box_side * box_side);
    for (int y = box.min.y; y < box.max.y; ++y)
      for (int x = box.min.x; x < box.max.x; ++x) {
        found[i].variance += part * double(film.variance(x, y).luminance());
        found[i].light += part * double(film.pixel(x, y).luminance());
      }
  });
  return found;
}

NoiseProbe::Ratio NoiseProbe::variance_ratio(const Integrator& other, const Integrator& reference,
                                             StopToken stop) const {
  std::vector<Box> others = look(other, stop), all = look(reference, stop);
  const auto count = double(all.size());
  double light = 0;
  for (const Box& box : others) light += box.light / count;
  double sum_of_others = 0, sum = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    constexpr double dark = 0.1;  // as a part of the mean: darker boxes count less
    const double scale = 1 / (sqr(others[i].light) + sqr(dark * light));
    sum_of_others += others[i].variance *= scale;
    sum += all[i].variance *= scale;
  }
  constexpr double unseen = 1e-8;  // relative to the square of light: rounding
  if (!(sum > unseen * count) || !std::isfinite(sum) || !std::isfinite(sum_of_others)) return {};
  const double value = sum_of_others / sum;
  double squares = 0;
  for (size_t i = 0; i < all.size(); ++i)
    if (const double rest = sum - all[i].variance; rest > 0)
      squares += sqr((sum_of_others - others[i].variance) / rest - value);
  return {value, std::sqrt(squares * (count - 1) / count)};
}

}  // namespace dapple::integrate
