// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

namespace dapple::glimpostor {

/// A context of OpenGL 3.3 core without a window: on a device that EGL lists, hardware before software, else on a
/// surfaceless display of Mesa. One thread at a time may have it current.
class EglContext {
 public:
  /// Null, and the reason, where there is none.
  static std::unique_ptr<EglContext> open(std::string* why);
  virtual ~EglContext() = default;

  /// Makes it current for the calling thread as long as this lives.
  class Current {
   public:
    explicit Current(EglContext& context) : context_(context) { context_.make_current(true); }
    ~Current() { context_.make_current(false); }
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    EglContext& context_;
  };
  /// What OpenGL calls its renderer, such as "llvmpipe (LLVM 15.0.6, 256 bits)".
  const std::string& renderer() const { return renderer_; }

 protected:
  virtual void make_current(bool current) = 0;
  std::string renderer_;
};

}  // namespace dapple::glimpostor
