// SPDX-License-Identifier: Apache-2.0
// A plug-in of another ABI version, or with ODD_LAYOUT of this version with another layout of data.
#include "dapple/shading/plugin.h"

namespace {
class Plain final : public dapple::shading::PluginMaterial {
 public:
  explicit Plain(const dapple::shading::PluginParams&) {}
};
}  // namespace

extern "C" __attribute__((visibility("default"))) const dapple::shading::PluginTable* dapple_shader_plugin() {
  static dapple::shading::PluginTable table = [] {
    auto t = dapple::shading::plugin_table<Plain>("plain");
#ifdef ODD_LAYOUT
    ++t.layout;
#else
    t.abi_version += 6;
#endif
    return t;
  }();
  return &table;
}
