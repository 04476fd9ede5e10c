// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"
#include "dapple/shafts/block_light.h"

namespace dapple::shafts {

/// A view ray in its plane.
struct ViewRay {
  int plane = 0;
  float cosine = 1, sine = 0;             ///< of the angle between the ray and the axis
  float begin = 0, end = 0;               ///< from where it meets the axis
  float lift = 0;                         ///< height there
  float density = 1, rate = 0;            ///< where it begins, and along it
  float k = 0, ahead = 0;                 ///< depths: sigma_t (k l + ahead - entry); of lamps: slope . way to it
  float first = 0, last = 0;              ///< coordinates of rays of light
  float slant = 0;                        ///< of parallel light: u over the height there
  float peak = 0;                         ///< of lamps: the angle at which the ray is nearest
  float nearest = 0, foot = 0;            ///< of lamps: how near, and how far from where the ray's lengths count
  V2f first_turn{0, 1}, last_turn{0, 1};  ///< of lamps: their sines and cosines
};

/// By channel, over sigma_s: of runs and steep blocks, as they are; of other blocks, times du / ds.
struct LightSums {
  double of[3] = {0, 0, 0};
  LaneSums bins;

  /// What channel c gets, or, of one, all.
  void add(int c, int channels, double light) {
    for (int i = c; i < (channels == 1 ? 3 : c + 1); ++i) of[i] += light;
  }
};

}  // namespace dapple::shafts
