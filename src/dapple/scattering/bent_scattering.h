// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "dapple/base/rgb.h"
#include "dapple/scattering/bsdf_sample.h"

namespace dapple::scattering {

struct Bsdf;

// Bsdf's eval_pdf() and sample() where its normal is bent: the rule of docs/design/024, over what the same Bsdf does
// without.

/// *pdf is 0 on entry.
RGB eval_pdf_bent(const Bsdf& b, const V3f& wo, const V3f& wi, uint64_t key, float* pdf);
/// Not of kind passthrough.
bool sample_bent(const Bsdf& b, const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out);

}  // namespace dapple::scattering
