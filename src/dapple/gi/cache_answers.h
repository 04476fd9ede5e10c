// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "dapple/gi/cache_log.h"
#include "dapple/integrate/integrator.h"
#include "dapple/scene/film.h"

namespace dapple::gi {

/// What answered the diffuse rays of a shading point: sums over its rays.
struct CacheAnswers {
  static constexpr int max_rays = 16;  ///< that are asked: of a longer stratified set, its first ones are one too

  int rays = 0;
  int by_resolution[integrate::resolution_count] = {};  ///< that ended in entries
  int shaded = 0;                                       ///< whose hits were shaded by themselves
  int known = 0;                                        ///< whose entries are in the log
  double fills = 0, fills_a_lookup = 0, filled_at = 0;  ///< of those

  void add(integrate::Resolution resolution, const CacheLog::Use* use) {
    ++by_resolution[size_t(resolution)];
    if (!use) return;
    ++known;
    fills += double(use->fills);
    fills_a_lookup += double(use->fills) / double(use->lookups);
    filled_at += use->filled_at;
  }

  /// Means. `seconds`: of rendering; an age is a share of it.
  scene::CacheFeatures means(double seconds) const {
    scene::CacheFeatures use;
    if (rays == 0) return use;
    const auto share = [this](int n) { return float(n) / float(rays); };
    use.coarse = share(by_resolution[size_t(integrate::Resolution::coarse)]);
    use.medium = share(by_resolution[size_t(integrate::Resolution::medium)]);
    use.fine = share(by_resolution[size_t(integrate::Resolution::fine)]);
    use.shaded = share(shaded);
    if (known == 0) return use;
    use.fills = float(fills / known);
    use.age = float(std::clamp(1 - filled_at / known / seconds, 0.0, 1.0));
    use.reuse = fills_a_lookup > 0 ? float(known / fills_a_lookup) : 0;
    return use;
  }
};

}  // namespace dapple::gi
