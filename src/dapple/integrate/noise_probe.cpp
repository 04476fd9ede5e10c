// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/noise_probe.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dapple/base/parallel.h"
#include "dapple/base/pool.h"
#include "dapple/numeric/sobol.h"
#include "dapple/scene/film.h"

namespace dapple::integrate {

NoiseProbe::NoiseProbe(const V2i& film, int pixel_samples) : film_(film), pixel_samples_(uint32_t(pixel_samples)) {
  if (film.x < box_side || film.y < box_side) return;
  const double image = double(film.x) * film.y * pixel_samples;
  const int count = int(std::min(image / image_samples, double(most_boxes)));
  constexpr uint32_t set = 0x6e6f6973;  // of all that random numbers are for
  for (int i = 0; i < count; ++i) {
    const V2f at = sample_2d(set, uint32_t(i), 0);
    const V2i corner(int(at.x * float(film.x - box_side + 1)), int(at.y * float(film.y - box_side + 1)));
    boxes_.push_back({corner, corner + V2i(box_side, box_side)});
  }
}

// Mean variance of the pixels of each box.
std::vector<double> NoiseProbe::variances(const Integrator& integrator, StopToken stop) const {
  std::vector<double> found(boxes_.size());
  Pool<Integrator::Workspace> pool;
  parallel_for(boxes_.size(), [&](size_t i) {
    stop.check();
    const Box2i& box = boxes_[i];
    scene::Film::Settings of_box;
    of_box.resolution = film_;
    of_box.crop = box;
    scene::Film film(of_box);
    auto workspace = pool.take([&] { return integrator.make_workspace(); });
    integrator.render({box, 0, samples, pixel_samples_, stop}, *workspace, film);
    pool.give(std::move(workspace));
    for (int y = box.min.y; y < box.max.y; ++y)
      for (int x = box.min.x; x < box.max.x; ++x) found[i] += double(film.variance(x, y).luminance());
  });
  return found;
}

double NoiseProbe::variance_ratio(const Integrator& other, const Integrator& reference, StopToken stop) const {
  const std::vector<double> others = variances(other, stop), all = variances(reference, stop);
  const double sum = std::accumulate(all.begin(), all.end(), 0.0);
  if (!(sum > 0) || !std::isfinite(sum)) return 1;
  // Boxes without noise say nothing.
  const double little = 1e-3 * sum / double(all.size());
  double logs = 0;
  for (size_t i = 0; i < all.size(); ++i) logs += std::log((others[i] + little) / (all[i] + little));
  return std::exp(logs / double(all.size()));
}

}  // namespace dapple::integrate
