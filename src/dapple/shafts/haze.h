// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/media/closed_form_medium.h"

namespace dapple::shafts {

/// What fills the air: sigma of density 1, 1/m, and the phase function of Henyey and Greenstein.
struct Haze {
  media::ExponentialDensity density;
  RGB sigma_s, sigma_t;
  media::HenyeyGreenstein phase;

  Haze() = default;
  explicit Haze(const media::ClosedFormMedium& medium)
      : density(medium.density()), sigma_s(medium.sigma_s()), sigma_t(medium.sigma_t()), phase(medium.phase()) {}
};

}  // namespace dapple::shafts
