// Owners of OpenGL 3.3 objects: programs, buffers, vertex arrays, and the render targets of the picture.
// Every call needs the context in which the object was created to be current.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>

namespace palpate {

using GlId = unsigned int;

/// A move-only name of one OpenGL object; `Kind` creates and deletes it.
template <class Kind>
class GlName {
 public:
  GlName() : id_(Kind::make()) {}
  ~GlName() {
    if (id_ != 0) Kind::drop(id_);
  }
  GlName(GlName&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  GlId id() const { return id_; }

 private:
  GlId id_;
};

struct BufferKind {
  static GlId make();
  static void drop(GlId id);
};
struct VertexArrayKind {
  static GlId make();
  static void drop(GlId id);
};
struct TextureKind {
  static GlId make();
  static void drop(GlId id);
};
struct RenderbufferKind {
  static GlId make();
  static void drop(GlId id);
};
struct FramebufferKind {
  static GlId make();
  static void drop(GlId id);
};
struct ProgramKind {
  static GlId make();
  static void drop(GlId id);
};

using GlBuffer = GlName<BufferKind>;
using GlVertexArray = GlName<VertexArrayKind>;
using GlTexture = GlName<TextureKind>;

/// A linked pair of shaders. Throws std::runtime_error with the driver's log when it does not compile or link.
class GlProgram {
 public:
  GlProgram(const std::string& name, const std::string& vertex, const std::string& fragment);
  void use() const;
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const Eigen::Vector2f& value) const;
  void set(const char* uniform, const Eigen::Vector3f& value) const;
  void set(const char* uniform, const Eigen::Matrix4f& value) const;

 private:
  int location(const char* uniform) const;
  GlName<ProgramKind> program_;
};

/// A render target: colour and depth, multisampled or not; a depth that can be sampled; or a colour that can be sampled.
class GlTarget {
 public:
  enum class Use { multisampled, picture, shadow_map, texture };
  GlTarget(int width, int height, Use use);
  void bind() const;  ///< selects it for drawing, with a viewport over all of it
  GlId framebuffer() const { return framebuffer_.id(); }
  GlId texture() const { return texture_.id(); }  ///< depth of a shadow map, colour of a texture
  Use use() const { return use_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  void attach_depth_texture();
  void attach_color_texture();
  void attach_buffers(int samples);

  Use use_;
  int width_, height_;
  GlName<FramebufferKind> framebuffer_;
  GlName<RenderbufferKind> color_, depth_;
  GlTexture texture_;
};

/// Replaces the content of a buffer that changes every frame.
void upload(const GlBuffer& buffer, std::span<const std::byte> bytes);

/// Sets attribute `index` of the bound vertex array: `size` floats of each vertex in the bound buffer, from `offset_floats` on.
void attribute(GlId index, int size, int stride_floats, int offset_floats);

void bind_texture(int unit, GlId texture);

}  // namespace palpate
