// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/media/closed_form_medium.h"

namespace dapple::media {

/// Haze that thins out with height: coefficients times exp(-height / scale height). Unlike a homogeneous medium it may
/// be without bounds under a sun at infinity.
class ExponentialMedium final : public ClosedFormMedium {
 public:
  /// As ClosedFormMedium's.
  ExponentialMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase, const ExponentialDensity& density)
      : ClosedFormMedium(sigma_a, sigma_s, emission, phase, density) {}
};

}  // namespace dapple::media
