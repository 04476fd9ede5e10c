// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/media/closed_form_medium.h"

namespace dapple::media {

/// The same coefficients everywhere.
class HomogeneousMedium final : public ClosedFormMedium {
 public:
  /// As ClosedFormMedium's.
  HomogeneousMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase)
      : ClosedFormMedium(sigma_a, sigma_s, emission, phase, {}) {}
};

}  // namespace dapple::media
