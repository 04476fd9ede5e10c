// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/gl_objects.h"

namespace dapple::glimpostor {

namespace {

class Shader {
 public:
  Shader(GLenum kind, const std::string& source) : name_(glCreateShader(kind)) {
    const char* const text = source.c_str();
    glShaderSource(name_, 1, &text, nullptr);
    glCompileShader(name_);
    GLint done = 0;
    glGetShaderiv(name_, GL_COMPILE_STATUS, &done);
    if (done) return;
    char words[1024] = "";
    glGetShaderInfoLog(name_, sizeof(words), nullptr, words);
    glDeleteShader(name_);
    throw GlError(std::string("a shader does not compile: ") + words);
  }
  ~Shader() { glDeleteShader(name_); }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;
  GLuint name() const { return name_; }

 private:
  const GLuint name_;
};

}  // namespace

void check_gl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  const char* const what = error == GL_OUT_OF_MEMORY       ? "out of memory"
                           : error == GL_INVALID_OPERATION ? "invalid operation"
                                                           : "invalid value";
  throw GlError(std::string(doing) + ": " + what);
}

Program::Program(const std::string& vertex, const std::string& fragment, std::initializer_list<const char*> outputs) {
  const Shader of_vertices(GL_VERTEX_SHADER, vertex), of_fragments(GL_FRAGMENT_SHADER, fragment);
  glAttachShader(program_.name(), of_vertices.name());
  glAttachShader(program_.name(), of_fragments.name());
  GLuint number = 0;
  for (const char* output : outputs) glBindFragDataLocation(program_.name(), number++, output);
  glLinkProgram(program_.name());
  GLint done = 0;
  glGetProgramiv(program_.name(), GL_LINK_STATUS, &done);
  if (done) return;
  char words[1024] = "";
  glGetProgramInfoLog(program_.name(), sizeof(words), nullptr, words);
  throw GlError(std::string("shaders do not link: ") + words);
}

void BufferTexture::set(GLenum format, const void* data, size_t bytes, size_t texel_bytes) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
  if (bytes / texel_bytes > size_t(most))
    throw GlError("a buffer of " + std::to_string(bytes / texel_bytes) + " texels; the device takes " +
                  std::to_string(most));
  glBindBuffer(GL_TEXTURE_BUFFER, buffer_.name());
  glBufferData(GL_TEXTURE_BUFFER, GLsizeiptr(bytes), data, GL_STREAM_DRAW);
  glBindTexture(GL_TEXTURE_BUFFER, texture_.name());
  glTexBuffer(GL_TEXTURE_BUFFER, format, buffer_.name());
  bytes_ = bytes;
}

void BufferTexture::bind(int unit) const {
  glActiveTexture(GLenum(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_BUFFER, texture_.name());
}

}  // namespace dapple::glimpostor
