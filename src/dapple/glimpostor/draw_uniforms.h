// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/glimpostor/drawer.h"
#include "dapple/glimpostor/gl_objects.h"

namespace dapple::glimpostor {

/// Matrices of a list, on the device (draw_list_glsl).
void set_draws(Draws draws, const DrawList& list, BufferTexture* to);

/// The uniforms that say where a region is.
void set_region(const Program& program, const Region& region);

}  // namespace dapple::glimpostor
