// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/cached_ends.h"

#include "dapple/base/hash.h"

namespace dapple::path {

using integrate::DiffuseHits;
using Left = PathWorkspace::Left;

void CachedEnds::prepare(PathWorkspace& w) const {
  if (!answers_) return;
  w.answers = answers_->make_workspace();
  w.diffuse_hits = std::make_unique<DiffuseHits>(answers_->groups());
}

void CachedEnds::end_rays(PathWorkspace& w) const {
  if (!answers_) return;
  DiffuseHits& hits = *w.diffuse_hits;
  hits.rays = &w.now->batch, hits.hits = &w.hit, hits.count = 0;
  for (int i = 0; i < w.now->count; ++i) {
    const int p = w.now->path[i];
    w.left[i] = Left::all;
    if (!w.reader[p].reads || w.hit.geometry[i] == trace::no_id) continue;
    w.reader[p].distance += w.hit.t[i];
    const int n = hits.count++;
    hits.ray[n] = i;
    hits.depth[n] = w.diffuse_depth[p];
    hits.width[n] = w.reader[p].width;
    hits.pdf[n] = w.bsdf_pdf[p];
    hits.distance[n] = w.reader[p].distance;
    hits.medium[n] = w.medium[p];
  }
  if (hits.count == 0) return;
  w.answers->stop = w.shadow_scratch.stop;
  answers_->answer(hits, *w.answers);
  for (int n = 0; n < hits.count; ++n) {
    if (!hits.known[n]) continue;
    const int i = hits.ray[n], p = w.now->path[i];
    w.add_light(p, w.beta[p], hits.L, n);
    w.left[i] = Left::nothing;
    constexpr uint64_t for_coats = 0x636f617473;
    if (to_unit_float(hash(w.vertex_key(p, 0), for_coats)) >= hits.onward[n]) continue;
    w.left[i] = Left::coat;
    w.beta[p] *= 1 / hits.onward[n];
  }
}

std::vector<integrate::CacheState> CachedEnds::caches() const {
  return answers_ ? answers_->caches() : std::vector<integrate::CacheState>();
}

void CachedEnds::collect_counts(PathWorkspace& w) const {
  if (answers_) answers_->collect_counts(*w.answers, &w.rays, &w.stages, w.caches);
}

}  // namespace dapple::path
