// SPDX-License-Identifier: Apache-2.0
// What stands in for gl_device.cpp and gl_picture.cpp where there is no OpenGL to build with.
#include "dapple/glimpostor/gl_device.h"
#include "dapple/glimpostor/gl_picture.h"

namespace dapple::glimpostor {

namespace {

constexpr const char* without = "Dapple was built without OpenGL (packages libepoxy-dev and libegl-dev)";

}  // namespace

impostor::BakeSettings bake_settings(GlPath /*path*/) {
  return {};
}

std::shared_ptr<impostor::ProjectionDevice> open_device(GlPath /*path*/, std::string* /*renderer*/, std::string* why) {
  *why = without;
  return nullptr;
}

std::optional<depthimage::ObjectPicture> gl_picture(const depthimage::SplatObject& /*object*/, int /*level*/,
                                                    const depthimage::ScreenMap& /*camera*/, const V2i& /*resolution*/,
                                                    const GlPictureSettings& /*settings*/, std::string* why) {
  *why = without;
  return std::nullopt;
}

}  // namespace dapple::glimpostor
