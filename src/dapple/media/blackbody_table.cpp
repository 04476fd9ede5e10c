// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/blackbody_table.h"

#include <algorithm>
#include <cmath>

#include "dapple/numeric/spectrum.h"

namespace dapple::media {
namespace {

RGB radiance(double kelvin) {
  const SampledSpectrum visible = blackbody(kelvin);  // 1 at its largest between 360 and 830 nm
  const double peak = 2.8977719e6 / kelvin;           // nm, Wien's law
  const double scale = planck(visible_max, kelvin) / (planck(peak, kelvin) * double(visible.values().back()));
  const auto luminance = float(integrate_xyz(visible).y * scale);
  return std::isfinite(luminance) ? emission_to_rgb(visible) * luminance : RGB(0);
}

}  // namespace

BlackbodyTable::BlackbodyTable(float most) {
  if (!(most > coldest)) {
    values_.assign(2, RGB(0)), per_log_ = 1;
    return;
  }
  const float top = std::clamp(most, 2 * coldest, hottest), range = std::log(top / coldest);
  const int steps = int(std::ceil(range / 0.004f));
  per_log_ = float(steps) / range;
  for (int i = 0; i <= steps; ++i)
    values_.push_back(radiance(double(coldest) * std::exp(double(i) / double(per_log_))));
  values_.front() = RGB(0);
}

}  // namespace dapple::media
