// SPDX-License-Identifier: Apache-2.0
// What stands in for gl_device.cpp where there is no OpenGL to build with.
#include "dapple/glimpostor/gl_device.h"

namespace dapple::glimpostor {

impostor::BakeSettings bake_settings(GlPath /*path*/) {
  return {};
}

std::shared_ptr<impostor::ProjectionDevice> open_device(GlPath /*path*/, std::string* /*renderer*/, std::string* why) {
  *why = "Dapple was built without OpenGL (packages libepoxy-dev and libegl-dev)";
  return nullptr;
}

}  // namespace dapple::glimpostor
