// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "dapple/build/texture_inputs.h"

namespace dapple::build {

/// A type of texture by name.
template <class T>
struct TextureType {
  std::string_view name;
  Pattern<T> (*make)(const TextureInputs&);
};

/// Dapple's own types of texture, for values of type T = float or RGB: arithmetic, ramps, coordinates, colour
/// operations and noise. Names and parameters follow MaterialX where it has them; docs/guide/patterns.md lists them.
template <class T>
std::vector<TextureType<T>> pattern_nodes();

extern template std::vector<TextureType<float>> pattern_nodes<float>();
extern template std::vector<TextureType<RGB>> pattern_nodes<RGB>();

}  // namespace dapple::build
