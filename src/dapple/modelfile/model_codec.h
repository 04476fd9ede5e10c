// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "dapple/modelfile/model.h"

namespace dapple::modelfile {

/// A model as bytes, and back. decode_model() trusts nothing: std::runtime_error where the bytes are damaged or
/// check_model() fails; memory stays in proportion to them.
std::string encode_model(const Model& model);
Model decode_model(std::string_view bytes);

}  // namespace dapple::modelfile
