// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/egl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstring>
#include <vector>

namespace dapple::glimpostor {

namespace {

constexpr int most_devices = 16;

class Context final : public EglContext {
 public:
  Context(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  ~Context() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
  void make_current(bool current) override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, current ? context_ : EGL_NO_CONTEXT);
  }
  void name_renderer() {
    const Current current(*this);
    if (const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER))) renderer_ = name;
  }

 private:
  const EGLDisplay display_;
  const EGLContext context_;
};

bool has(const char* extensions, const char* name) {
  return extensions && std::strstr(extensions, name) != nullptr;
}

// Hardware first.
std::vector<EGLDisplay> displays() {
  std::vector<EGLDisplay> hardware, software;
  const char* const client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (has(client, "EGL_EXT_platform_base") && has(client, "EGL_EXT_platform_device") &&
      (has(client, "EGL_EXT_device_enumeration") || has(client, "EGL_EXT_device_base"))) {
    std::array<EGLDeviceEXT, most_devices> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(most_devices, devices.data(), &count))
      for (EGLint i = 0; i < count; ++i) {
        const char* const of_device = eglQueryDeviceStringEXT(devices[size_t(i)], EGL_EXTENSIONS);
        const bool is_software = has(of_device, "EGL_MESA_device_software");
        (is_software ? software : hardware)
            .push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[size_t(i)], nullptr));
      }
  }
  if (has(client, "EGL_EXT_platform_base") && has(client, "EGL_MESA_platform_surfaceless"))
    software.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  hardware.insert(hardware.end(), software.begin(), software.end());
  return hardware;
}

std::unique_ptr<Context> open_on(EGLDisplay display) {
  EGLint major = 0, minor = 0;
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, &major, &minor)) return nullptr;
  if (!has(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context") || !eglBindAPI(EGL_OPENGL_API))
    return nullptr;
  const EGLint any_surface[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglChooseConfig(display, any_surface, &config, 1, &count) || count == 0) return nullptr;
  const EGLint version[] = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
  if (context == EGL_NO_CONTEXT) return nullptr;
  auto out = std::make_unique<Context>(display, context);
  out->name_renderer();
  return out->renderer().empty() ? nullptr : std::move(out);
}

}  // namespace

std::unique_ptr<EglContext> EglContext::open(std::string* why) {
  if (!epoxy_has_egl()) {
    *why = "there is no EGL (package libegl1)";
    return nullptr;
  }
  for (const EGLDisplay display : displays())
    if (auto context = open_on(display)) return context;
  *why = "no display gives a context of OpenGL 3.3 without a window (package libgl1-mesa-dri has one by software)";
  return nullptr;
}

}  // namespace dapple::glimpostor
