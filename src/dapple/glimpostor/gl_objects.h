// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <epoxy/gl.h>

#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

namespace dapple::glimpostor {

/// What the driver refuses, with its words.
struct GlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws GlError where OpenGL has an error since the last call.
void check_gl(const char* doing);

/// An object of OpenGL, deleted with its owner, while the context that made it is current.
template <typename Traits>
class GlObject {
 public:
  GlObject() : name_(Traits::make()) {}
  ~GlObject() {
    if (name_) Traits::free(name_);
  }
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

struct BufferTraits {
  static GLuint make() {
    GLuint name = 0;
    glGenBuffers(1, &name);
    return name;
  }
  static void free(GLuint name) { glDeleteBuffers(1, &name); }
};
struct TextureTraits {
  static GLuint make() {
    GLuint name = 0;
    glGenTextures(1, &name);
    return name;
  }
  static void free(GLuint name) { glDeleteTextures(1, &name); }
};
struct FramebufferTraits {
  static GLuint make() {
    GLuint name = 0;
    glGenFramebuffers(1, &name);
    return name;
  }
  static void free(GLuint name) { glDeleteFramebuffers(1, &name); }
};
struct VertexArrayTraits {
  static GLuint make() {
    GLuint name = 0;
    glGenVertexArrays(1, &name);
    return name;
  }
  static void free(GLuint name) { glDeleteVertexArrays(1, &name); }
};
struct ProgramTraits {
  static GLuint make() { return glCreateProgram(); }
  static void free(GLuint name) { glDeleteProgram(name); }
};

using Buffer = GlObject<BufferTraits>;
using Texture = GlObject<TextureTraits>;
using Framebuffer = GlObject<FramebufferTraits>;
using VertexArray = GlObject<VertexArrayTraits>;

/// A vertex and a fragment shader, linked.
class Program {
 public:
  /// GlError with the compiler's words.
  Program(const std::string& vertex, const std::string& fragment, std::initializer_list<const char*> outputs);

  void use() const { glUseProgram(program_.name()); }
  GLint at(const char* uniform) const { return glGetUniformLocation(program_.name(), uniform); }

 private:
  GlObject<ProgramTraits> program_;
};

/// An array that shaders read by index (a buffer texture).
class BufferTexture {
 public:
  /// Replaces what it holds. GlError for more texels than the device takes.
  void set(GLenum format, const void* data, size_t bytes, size_t texel_bytes);
  void bind(int unit) const;
  size_t bytes() const { return bytes_; }

 private:
  Buffer buffer_;
  Texture texture_;
  size_t bytes_ = 0;
};

}  // namespace dapple::glimpostor
