// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/scenefile/param_set.h"
#include "dapple/scenefile/tokenizer.h"

namespace dapple::scenefile {

/// Reads parameter lists: `"type name" value` or `"type name" [ values ]`, any number of them. Keeps its buffers
/// between lists, so that large arrays are copied once, at their final size.
class ParamParser {
 public:
  /// Adds the parameters from here up to the next directive. InputError for an unknown type, values of the wrong kind
  /// or an odd number of values in a spectrum; of a name that is given twice the last value counts, with a warning.
  void parse_list(Tokenizer* tokenizer, ColorSpace color_space, ParamSet* set, Diagnostics* diagnostics);

  /// The value of `Option "name" value`, whose type shows in the value itself.
  Param parse_option(Tokenizer* tokenizer);

 private:
  Param parse_param(Tokenizer* tokenizer, ColorSpace color_space);
  void read_values(Tokenizer* tokenizer, size_t most, Param* param);
  void read_words(Tokenizer* tokenizer, size_t most, Param* param);

  std::vector<float> numbers_;
  std::vector<int32_t> integers_;
};

}  // namespace dapple::scenefile
