// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/sequence_denoiser.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dapple::denoise {

using image::Image;

SequenceDenoiser::SequenceDenoiser(const Denoiser& denoiser, size_t count, int neighbours, double step, Load load)
    : denoiser_(denoiser), count_(count), neighbours_(neighbours), step_(step), load_(std::move(load)) {}

const SequenceFrame& SequenceDenoiser::loaded(size_t i) {
  const auto found = loaded_.find(i);
  return found != loaded_.end() ? found->second : loaded_.emplace(i, load_(i)).first->second;
}

std::vector<size_t> SequenceDenoiser::around(size_t i) {
  std::vector<size_t> others;
  const SequenceFrame& at = loaded(i);
  if (!at.can_be_found()) return others;
  const auto n = size_t(neighbours_);
  for (size_t j = i - std::min(i, n); j < std::min(count_, i + n + 1); ++j)
    if (j != i && loaded(j).can_be_found() && std::abs(loaded(j).number - at.number) <= (neighbours_ + .5) * step_)
      others.push_back(j);
  return others;
}

// Neighbours count the less the farther they are, down to nothing one frame beyond the last: of noise that differs from
// frame to frame such means change least, in second differences (n + 1)^2 times less than single frames.
const SequenceDenoiser::Means& SequenceDenoiser::means(size_t i) {
  if (const auto found = means_.find(i); found != means_.end()) return found->second;
  std::vector<size_t> others = around(i);
  std::vector<TemporalBlend::Neighbour> neighbours;
  for (const size_t j : others) {
    const double frames = loaded(j).number - loaded(i).number;
    neighbours.push_back({&loaded(j), frames, float(1 - std::abs(frames) / ((neighbours_ + 1) * step_))});
  }
  return means_.emplace(i, Means{std::move(others), TemporalBlend(loaded(i), neighbours)}).first->second;
}

const SequenceDenoiser::Part& SequenceDenoiser::denoised(size_t i) {
  if (const auto found = denoised_.find(i); found != denoised_.end()) return found->second;
  const Means& mean = means(i);
  const SequenceFrame& f = loaded(i);
  const auto network = [&](float exposure, const auto& noisy_of) {
    std::vector<const Image*> others;
    for (const size_t j : mean.others) others.push_back(&noisy_of(loaded(j)));
    return denoiser_(mean.blend(noisy_of(f), others), f.albedo.empty() ? nullptr : &f.albedo,
                     f.normal.empty() ? nullptr : &f.normal, {.exposure = exposure});
  };
  Part part;
  part.colour = network(f.exposure, [](const SequenceFrame& of) -> const Image& { return of.noisy; });
  for (size_t g = 0; g < f.light_groups.size(); ++g)
    part.groups.push_back(network(0, [g](const SequenceFrame& of) -> const Image& { return of.light_groups[g]; }));
  return denoised_.emplace(i, std::move(part)).first->second;
}

SequenceDenoiser::Result SequenceDenoiser::operator()(size_t i) {
  const Means& mean = means(i);
  const Part& own = denoised(i);
  std::vector<const Part*> others;
  for (const size_t j : mean.others) others.push_back(&denoised(j));
  const auto blended = [&](const auto& image_of) {
    std::vector<const Image*> images;
    for (const Part* part : others) images.push_back(&image_of(*part));
    return mean.blend(image_of(own), images);
  };
  Result result;
  result.colour = blended([](const Part& p) -> const Image& { return p.colour; });
  for (size_t g = 0; g < own.groups.size(); ++g)
    result.light_groups.push_back(blended([g](const Part& p) -> const Image& { return p.groups[g]; }));
  add_up_to(result.colour, result.light_groups);
  result.share = mean.blend.share();
  skip(i);
  return result;
}

void SequenceDenoiser::skip(size_t i) {
  const size_t oldest = i + 1 - std::min(i + 1, size_t(neighbours_));
  means_.erase(means_.begin(), means_.upper_bound(i));
  loaded_.erase(loaded_.begin(), loaded_.lower_bound(oldest));
  denoised_.erase(denoised_.begin(), denoised_.lower_bound(oldest));
}

}  // namespace dapple::denoise
