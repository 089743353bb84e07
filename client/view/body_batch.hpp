// The body's triangles on the graphics side.
//
// They are refined into curved point-normal triangles that pass through the received vertices, so contact stays where it is;
// beyond a limit on their number they are drawn unrefined. Data that did not change since the last moment is neither computed nor
// uploaded again.
#pragma once

#include <vector>

#include "client/view/cavity.hpp"
#include "client/view/gl_objects.hpp"
#include "client/view/sight.hpp"

namespace palpate {

class BodyBatch {
 public:
  /// Needs a current OpenGL 3.3 core context, as do all functions below.
  BodyBatch();
  /// Shows this moment from now on. Returns true when it differs from the one before.
  bool show(const Sight& sight, const Look& look);
  /// True when triangles are unrefined: shaders::plain_body_vertex(); otherwise shaders::curved_body_vertex().
  bool plain() const { return made_.level == 1; }
  void draw() const;

 private:
  /// Data of vertex `corner` of a triangle; three are a triangle.
  struct Corner {
    Vec3f position, normal, look,
        strain;  ///< look: scalar, cavity, 1 fixed, -1 wall or 2 thread; strain: of the edge opposite each corner
    float body;  ///< MeshVertex::body
  };
  /// The data from which the corners are computed.
  struct Made {
    std::vector<Triangle> triangles;
    std::vector<Vec3f> positions, rest;
    std::vector<float> scalars;
    std::vector<std::uint8_t> marks;  ///< mark_of() each vertex
    bool closed = false, strained = false;
    int level = 0;

    bool operator==(const Made& other) const = default;
  };
  void refine(int level);
  void fill();
  bool is_wall(const Triangle& triangle) const;
  void find_walls();
  void add_corners(const std::vector<Triangle>& triangles, bool walls);
  Vec3f strain_of(const Triangle& triangle) const;

  GlVertexArray plain_array_, curved_array_;
  GlBuffer pattern_buffer_, corner_buffer_;
  Cavity cavity_;
  std::vector<Triangle> walls_, outer_;  // an edge between both is sharp
  std::vector<Vec3f> normals_;
  std::vector<float> hollow_;
  std::vector<Corner> corners_;
  Made made_, next_;
  int pattern_vertices_ = 0;
};

}  // namespace palpate
