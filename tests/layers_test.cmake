# SPDX-License-Identifier: Apache-2.0
# cmake -DSCRIPT=<layers.cmake> -DWORK=<scratch folder> -P tests/layers_test.cmake
# Runs the layering check on small trees, each with one fault, and demands that it finds the fault.
cmake_policy(VERSION 3.25)

set(spdx "// SPDX-License-Identifier: Apache-2.0\n")

set(always CMakeLists.txt "# SPDX-License-Identifier: Apache-2.0\n")
include(${CMAKE_CURRENT_LIST_DIR}/expect_fault.cmake)

expect(ok src/dapple/geom/a.h "${spdx}#include <vector>\n#include \"dapple/base/vec.h\"\n#include \"dapple/geom/b.h\"\n"
  src/dapple/geom/README.md "Begin with `a.h`.\n")
expect("src/dapple/geom/README.md: missing" src/dapple/geom/a.h "${spdx}")
expect("src/dapple/geom/README.md:2: b.h is not in this folder" src/dapple/geom/a.h "${spdx}"
  src/dapple/geom/README.md "Begin with `a.h`,\nthen `b.h`.\n")
expect("src/dapple/geom/a.h:3: geom must not include trace"
  src/dapple/geom/a.h "${spdx}#include \"dapple/base/vec.h\"\n#include \"dapple/trace/b.h\"\n")
expect("base must not include numeric" src/dapple/base/a.cpp "${spdx}#  include <dapple/numeric/b.h>\n")
expect("gi and forest must not name each other" src/dapple/gi/a.h "${spdx}#include \"dapple/forest/b.h\"\n")
expect("forest and gi must not name each other" src/dapple/forest/a.h "${spdx}#include \"dapple/gi/b.h\"\n")
expect("src/dapple/base/a.cpp:2: write the include from the root" src/dapple/base/a.cpp "${spdx}#include \"../trace/b.h\"\n")
expect("src/dapple/film: not a library" src/dapple/film/a.h "${spdx}")
expect("src/dapple/base/a.h:1: does not begin with" src/dapple/base/a.h "#pragma once\n")
expect("scripts/go:1: does not begin with" scripts/go "#!/bin/sh\necho\n" src/dapple/base/a.h "${spdx}")
file(REMOVE_RECURSE ${WORK})
message("The layering check finds what it should.")
