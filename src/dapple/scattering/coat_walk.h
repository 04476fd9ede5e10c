// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/coat_stack.h"

namespace dapple::scattering {

/// What crosses the coat twice, one estimate: a position-free random walk from wo (Guo, Hasan & Zhao 2018) that joins
/// wi by two strategies at each event, weighted by the power heuristic: a direction sampled by the coat from wi's side,
/// and the walk's own next direction. wo.z > 0 and wi.z > 0.
RGB walk_coat(const CoatStack& stack, const V3f& wo, const V3f& wi, KeyedRng& rng);

}  // namespace dapple::scattering
