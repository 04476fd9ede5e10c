// SPDX-License-Identifier: Apache-2.0
// A shared object that is no plug-in.
extern "C" int dapple_shader() {
  return 1;
}
