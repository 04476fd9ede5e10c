# SPDX-License-Identifier: Apache-2.0
# dapple_add_plugin(name sources...): a shader plug-in lib<name>.so (docs/guide/shaders.md). Installed with the package.
#
# It contains what it calls in Dapple's static libraries, which keep no state, and shows the program nothing but its entry
# point, so that it runs in any program that has the same headers. No contraction, so that images do not depend on the compiler's choice.
function(dapple_add_plugin name)
  add_library(${name} MODULE ${ARGN})
  target_link_libraries(${name} PRIVATE dapple::shading)
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_compile_options(${name} PRIVATE -ffp-contract=off)
  set_target_properties(${name} PROPERTIES PREFIX lib SUFFIX .so CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_link_options(${name} PRIVATE -Wl,--exclude-libs,ALL -Wl,--as-needed)
  if(NOT DAPPLE_SANITIZE)
    target_link_options(${name} PRIVATE -Wl,-z,defs)
  endif()
endfunction()
