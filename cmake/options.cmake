# SPDX-License-Identifier: Apache-2.0
include(CheckCXXSourceRuns)

add_library(dapple_options INTERFACE)
target_compile_options(dapple_options INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-unused-parameter)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(dapple_options INTERFACE -Wno-restrict)  # false positives of GCC 12 on std::string
endif()
if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  target_compile_options(dapple_options INTERFACE -Wno-shadow)  # warns of parameters named as a member even in static functions
endif()
if(DAPPLE_WERROR)
  target_compile_options(dapple_options INTERFACE -Werror)
endif()
# Determinism (DESIGN promise 3): no contraction, no fast-math. The two flags below change no result.
target_compile_options(dapple_options INTERFACE -ffp-contract=off -fno-math-errno -fno-trapping-math)
# Position-independent for plug-ins and Python, but nobody replaces our functions at load time: they may be inlined.
target_compile_options(dapple_options INTERFACE -fno-semantic-interposition)

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(isa ${DAPPLE_ISA})
  if(isa STREQUAL "auto")
    check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"fma\") && __builtin_cpu_supports(\"bmi2\") ? 0 : 1; }" DAPPLE_HAS_V3)
    set(isa $<IF:$<BOOL:${DAPPLE_HAS_V3}>,x86-64-v3,x86-64-v2>)
  endif()
  target_compile_options(dapple_options INTERFACE -march=${isa})
endif()

if(DAPPLE_SANITIZE)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(dapple_options INTERFACE -Wno-maybe-uninitialized)  # false positives under instrumentation
  endif()
  target_compile_options(dapple_options INTERFACE -fsanitize=${DAPPLE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(dapple_options INTERFACE -fsanitize=${DAPPLE_SANITIZE})
endif()
if(DAPPLE_FUZZ)
  target_compile_options(dapple_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(DAPPLE_STD_THREADS)
  target_compile_definitions(dapple_options INTERFACE DAPPLE_STD_THREADS)
endif()
