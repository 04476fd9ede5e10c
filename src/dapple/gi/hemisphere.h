// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::gi {

/// A hemisphere in rings of equal cosine-weighted solid angle, each in the same number of sectors; z is the pole.
class HemisphereStrata {
 public:
  /// About `rays` strata, about as wide as long. At least one.
  explicit HemisphereStrata(int rays);

  int rings() const { return rings_; }
  int sectors() const { return sectors_; }
  int count() const { return rings_ * sectors_; }  ///< ring after ring
  /// Direction of stratum i < count(); x and y in [0, 1) say where in it: density cos / pi.
  V3f direction(int i, float x, float y) const;

  struct Ring {
    float sine, sine_outside;  ///< of its edges
    float tangent;             ///< mean
    float by_pole;             ///< IrradianceRecord::by_normal[2] of light from there, of its irradiance
  };
  const Ring& ring(int j) const { return ring_[size_t(j)]; }
  struct Sector {
    V2f middle, edge;  ///< directions in the plane; the edge towards the sector before
  };
  const Sector& sector(int k) const { return sector_[size_t(k)]; }

 private:
  int rings_, sectors_;
  std::vector<Ring> ring_;
  std::vector<Sector> sector_;
};

/// Irradiance at a place and how it changes around there, in a frame whose pole is the normal: with the place along the
/// two tangents (1/m; Ward and Heckbert, "Irradiance gradients", 1992), and with the normal, in which it is linear.
/// That holds for each light that a turned receiver still sees, and for a uniform hemisphere to first order: the part
/// along the pole is fitted to turns by 30 degrees. With time it is taken as linear too (Gautron, Bouatouch, Pattanaik,
/// "Temporal radiance caching", 2007).
struct IrradianceRecord {
  RGB E;
  RGB by_place[2], by_normal[3];
  RGB by_time;  ///< over the time that its rays are spread over
  /// To the nearest surface, without those almost in the tangent plane. Less where the gradient is as large as E. May
  /// be infinite.
  float distance = 0;

  /// At a place offset by (ds, dt), with a normal n, in the record's frame, so long after its middle as a share of its
  /// time. Never negative.
  RGB at(float ds, float dt, const V3f& n, float time = 0) const;
};

/// From radiance L[i] that arrived through stratum i, the distance r[i] it came from (infinite for a miss), and when,
/// as at() takes it; null: nothing depends on it.
IrradianceRecord integrate_hemisphere(const HemisphereStrata& strata, const RGB* L, const float* r,
                                      const float* time = nullptr);

}  // namespace dapple::gi
