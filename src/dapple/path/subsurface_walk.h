// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/hash.h"
#include "dapple/media/homogeneous_medium.h"
#include "dapple/scattering/bsdf.h"

namespace dapple::path {

/// The part of a light path that lies inside a subsurface body: a random walk in a homogeneous medium, bounded by
/// whatever is hit. Distances are drawn for one channel in proportion to throughput, weighed over all of them
/// (HomogeneousMedium); directions after Henyey and Greenstein. Unbiased: Russian roulette alone ends it, by
/// throughput. Coefficients are those below the point where the path entered.
class SubsurfaceWalk {
 public:
  /// A walk ends for good after so many scatterings: of a body that neither absorbs nor lets out.
  static constexpr int max_scatterings = 1 << 20;

  void start() { inside_ = false; }
  bool inside() const { return inside_; }
  /// The path has scattered since it entered: it leaves diffused.
  bool scattered() const { return scatterings_ > 0; }
  /// The inside is as clear as glass.
  bool is_clear() const { return sigma_a_.is_black() && sigma_s_.is_black(); }

  /// The path goes on along d from a boundary of normal Ng, on the outside: inwards, or out.
  void cross(const scattering::Bsdf& boundary, bool inwards) {
    if (inwards && !inside_) {
      sigma_s_ = boundary.extinction * boundary.medium_albedo;
      sigma_a_ = boundary.extinction - sigma_s_;
      g_ = boundary.g;
      scatterings_ = 0;
    }
    inside_ = inwards;
  }

  enum class Flight { arrived, scattered, ended };
  /// Flies along the ray, at most to t_max, which must be finite. Multiplies beta by the weight; where it scatters, *P
  /// and *d become the place and the direction that follow. `scale`: of beta in the roulette.
  Flight fly(const Ray& ray, float t_max, float scale, uint64_t key, RGB* beta, V3f* P, V3f* d) {
    const media::HenyeyGreenstein phase{g_};
    const media::HomogeneousMedium medium(sigma_a_, sigma_s_, RGB(), phase);
    const media::MediumSample s = medium.sample(ray, t_max, *beta, hash(key, 1));
    *beta *= s.weight;
    if (beta->is_black() || !beta->is_finite()) return Flight::ended;
    if (!s.scattered) return Flight::arrived;
    KeyedRng rng(hash(key, 2));
    const float survive = std::min(1.0f, beta->max() * scale);
    if (++scatterings_ > max_scatterings || rng.next() >= survive) return Flight::ended;
    *beta *= 1 / survive;
    *P = ray.o + ray.d * s.t;
    const float u = rng.next();
    phase.sample(-ray.d, V2f(u, rng.next()), d);
    return Flight::scattered;
  }

 private:
  RGB sigma_a_, sigma_s_;
  float g_ = 0;
  int32_t scatterings_ = 0;
  bool inside_ = false;
};

}  // namespace dapple::path
