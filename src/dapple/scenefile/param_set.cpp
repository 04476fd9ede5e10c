// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/param_set.h"
