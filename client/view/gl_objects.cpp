#include "client/view/gl_objects.hpp"

#include <epoxy/gl.h>

#include <array>
#include <stdexcept>

namespace palpate {
namespace {

constexpr int kSamples = 4;

GlId compile(const std::string& name, GLenum stage, const std::string& text) {
  const GlId shader = glCreateShader(stage);
  const std::string full = "#version 330 core\n" + text;
  const char* source = full.c_str();
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == 0) {
    std::array<char, 2000> log{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteShader(shader);
    throw std::runtime_error("shader " + name + ": " + log.data());
  }
  return shader;
}

template <class Generate>
GlId make_with(Generate generate) {
  GLuint id = 0;
  generate(1, &id);
  return id;
}

}  // namespace

GlId BufferKind::make() { return make_with(glGenBuffers); }
void BufferKind::drop(GlId id) { glDeleteBuffers(1, &id); }
GlId VertexArrayKind::make() { return make_with(glGenVertexArrays); }
void VertexArrayKind::drop(GlId id) { glDeleteVertexArrays(1, &id); }
GlId TextureKind::make() { return make_with(glGenTextures); }
void TextureKind::drop(GlId id) { glDeleteTextures(1, &id); }
GlId RenderbufferKind::make() { return make_with(glGenRenderbuffers); }
void RenderbufferKind::drop(GlId id) { glDeleteRenderbuffers(1, &id); }
GlId FramebufferKind::make() { return make_with(glGenFramebuffers); }
void FramebufferKind::drop(GlId id) { glDeleteFramebuffers(1, &id); }
GlId ProgramKind::make() { return glCreateProgram(); }
void ProgramKind::drop(GlId id) { glDeleteProgram(id); }

GlProgram::GlProgram(const std::string& name, const std::string& vertex, const std::string& fragment) {
  const GlId vs = compile(name + " (vertex)", GL_VERTEX_SHADER, vertex);
  const GlId fs = compile(name + " (fragment)", GL_FRAGMENT_SHADER, fragment);
  glAttachShader(program_.id(), vs);
  glAttachShader(program_.id(), fs);
  glLinkProgram(program_.id());
  glDeleteShader(vs);
  glDeleteShader(fs);
  GLint ok = 0;
  glGetProgramiv(program_.id(), GL_LINK_STATUS, &ok);
  if (ok == 0) {
    std::array<char, 2000> log{};
    glGetProgramInfoLog(program_.id(), static_cast<GLsizei>(log.size()), nullptr, log.data());
    throw std::runtime_error("program " + name + ": " + log.data());
  }
}

void GlProgram::use() const { glUseProgram(program_.id()); }
int GlProgram::location(const char* uniform) const { return glGetUniformLocation(program_.id(), uniform); }
void GlProgram::set(const char* uniform, int value) const { glUniform1i(location(uniform), value); }
void GlProgram::set(const char* uniform, float value) const { glUniform1f(location(uniform), value); }
void GlProgram::set(const char* uniform, const Eigen::Vector2f& value) const { glUniform2fv(location(uniform), 1, value.data()); }
void GlProgram::set(const char* uniform, const Eigen::Vector3f& value) const { glUniform3fv(location(uniform), 1, value.data()); }
void GlProgram::set(const char* uniform, const Eigen::Matrix4f& value) const {
  glUniformMatrix4fv(location(uniform), 1, GL_FALSE, value.data());
}

GlTarget::GlTarget(int width, int height, Use use) : use_(use), width_(width), height_(height) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  switch (use) {
    case Use::shadow_map:
      attach_depth_texture();
      break;
    case Use::texture:
      attach_color_texture();
      break;
    case Use::multisampled:
      attach_buffers(kSamples);
      break;
    case Use::picture:
      attach_buffers(0);
      break;
  }
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL made no framebuffer of " + std::to_string(width) + "x" + std::to_string(height));
  }
}

void GlTarget::attach_depth_texture() {
  glBindTexture(GL_TEXTURE_2D, texture_.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, width_, height_, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const std::array<float, 4> lit{1, 1, 1, 1};
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, lit.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture_.id(), 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
}

void GlTarget::attach_color_texture() {
  glBindTexture(GL_TEXTURE_2D, texture_.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width_, height_, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.id(), 0);
}

void GlTarget::attach_buffers(int samples) {
  glBindRenderbuffer(GL_RENDERBUFFER, color_.id());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, width_, height_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_.id());
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.id());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT24, width_, height_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_.id());
}

void GlTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, width_, height_);
}

void upload(const GlBuffer& buffer, std::span<const std::byte> bytes) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes.size()), bytes.data(), GL_STREAM_DRAW);
}

void attribute(GlId index, int size, int stride_floats, int offset_floats) {
  glEnableVertexAttribArray(index);
  glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, stride_floats * static_cast<int>(sizeof(float)),
                        reinterpret_cast<const void*>(static_cast<std::uintptr_t>(offset_floats) * sizeof(float)));
}

void bind_texture(int unit, GlId texture) {
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture);
}

}  // namespace palpate
