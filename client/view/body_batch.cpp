#include "client/view/body_batch.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr int kMaxLevel = 4;

/// Returns the corners of the level^2 equal parts of a triangle, as weights of its corners.
std::vector<Vec3f> refinement(int level) {
  std::vector<Vec3f> pattern;
  const auto at = [level](int i, int j) -> Vec3f {
    return Vec3f(static_cast<float>(level - i - j), static_cast<float>(i), static_cast<float>(j)) / static_cast<float>(level);
  };
  for (int i = 0; i < level; ++i) {
    for (int j = 0; i + j < level; ++j) {
      pattern.insert(pattern.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < level) pattern.insert(pattern.end(), {at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return pattern;
}

int affordable_level(const Sight& sight, const Look& look) {
  const auto triangles = std::max(1.0, static_cast<double>(sight.triangles.size()));
  return std::clamp(static_cast<int>(std::sqrt(look.triangle_budget / triangles)), 1, kMaxLevel);
}

}  // namespace

BodyBatch::BodyBatch() {
  constexpr int kFloats = sizeof(Corner) / sizeof(float);
  constexpr int kBody = 12;
  static_assert(kFloats == kBody + 1, "Corner is four packed vectors and a number");
  glBindVertexArray(plain_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, corner_buffer_.id());
  for (GLuint i = 0; i < 4; ++i) attribute(i, 3, kFloats, 3 * static_cast<int>(i));
  attribute(4, 1, kFloats, kBody);
  // The strain of a triangle is the same at its three corners: that of the first one is used.
  glBindVertexArray(curved_array_.id());
  for (GLuint i = 0; i < 10; ++i) {
    const int corner = i < 4 ? 0 : i < 7 ? 1 : 2, of_corner = static_cast<int>(i) - (i < 4 ? 0 : i < 7 ? 4 : 7);
    attribute(i, 3, 3 * kFloats, corner * kFloats + 3 * of_corner);
    glVertexAttribDivisor(i, 1);
  }
  attribute(11, 1, 3 * kFloats, kBody);
  glVertexAttribDivisor(11, 1);
  glBindBuffer(GL_ARRAY_BUFFER, pattern_buffer_.id());
  attribute(10, 3, 3, 0);
}

bool BodyBatch::show(const Sight& sight, const Look& look) {
  next_.triangles.assign(sight.triangles.begin(), sight.triangles.end());
  next_.positions.assign(sight.positions.begin(), sight.positions.end());
  next_.rest.assign(sight.rest.begin(), sight.rest.end());
  next_.scalars.assign(sight.scalars.begin(), sight.scalars.end());
  next_.marks.resize(sight.vertices.size());
  std::transform(sight.vertices.begin(), sight.vertices.end(), next_.marks.begin(),
                 [](const MeshVertex& v) { return mark_of(v); });
  next_.closed = sight.closed;
  next_.strained = look.lines == Lines::strain;
  next_.level = affordable_level(sight, look);
  if (next_ == made_) return false;
  if (next_.level != made_.level) refine(next_.level);
  if (next_.triangles != made_.triangles || next_.rest != made_.rest) cavity_.prepare(next_.triangles, next_.rest);
  const bool others = next_.triangles != made_.triangles || next_.marks != made_.marks;
  std::swap(next_, made_);
  if (others) find_walls();
  fill();
  return true;
}

bool BodyBatch::is_wall(const Triangle& t) const {
  return !made_.marks.empty() && std::ranges::any_of(t, [&](std::uint32_t i) { return made_.marks[i] % kBodyMark == kWallMark; });
}

void BodyBatch::find_walls() {
  walls_.clear();
  outer_.clear();
  for (const Triangle& t : made_.triangles) (is_wall(t) ? walls_ : outer_).push_back(t);
}

void BodyBatch::refine(int level) {
  const std::vector<Vec3f> pattern = refinement(level);
  upload(pattern_buffer_, std::as_bytes(std::span(pattern)));
  pattern_vertices_ = static_cast<int>(pattern.size());
}

Vec3f BodyBatch::strain_of(const Triangle& t) const {
  Vec3f strain = Vec3f::Zero();
  for (std::size_t k = 0; made_.strained && k < 3; ++k) {
    const std::uint32_t from = t[(k + 1) % 3], to = t[(k + 2) % 3];
    const float length = (made_.rest[to] - made_.rest[from]).norm();
    if (length > 0) strain[static_cast<int>(k)] = (made_.positions[to] - made_.positions[from]).norm() / length - 1;
  }
  return strain;
}

void BodyBatch::fill() {
  update_normals(made_.triangles, made_.positions, normals_);
  cavity_.measure(made_.positions, normals_, hollow_);
  corners_.clear();
  if (!walls_.empty()) update_normals(outer_, made_.positions, normals_);
  add_corners(outer_, false);
  if (!walls_.empty()) update_normals(walls_, made_.positions, normals_);
  add_corners(walls_, true);
  upload(corner_buffer_, std::as_bytes(std::span(corners_)));
}

/// Adds the corners of these triangles, with the normals of the same.
void BodyBatch::add_corners(const std::vector<Triangle>& triangles, bool walls) {
  for (const Triangle& t : triangles) {
    const Vec3f strain = strain_of(t);
    for (const std::uint32_t i : t) {
      const float scalar = made_.scalars.empty() ? (made_.positions[i] - made_.rest[i]).norm() : made_.scalars[i];
      const std::uint8_t mark = made_.marks.empty() ? 0 : made_.marks[i];
      const float kind = walls ? -1.0F : mark % kBodyMark == kFixedMark ? 1.0F : mark % kBodyMark == kThreadMark ? 2.0F : 0.0F;
      corners_.push_back(
          {made_.positions[i], normals_[i], Vec3f(scalar, hollow_[i], kind), strain, static_cast<float>(mark / kBodyMark)});
    }
  }
}

void BodyBatch::draw() const {
  if (made_.closed) glEnable(GL_CULL_FACE);
  glBindVertexArray(plain() ? plain_array_.id() : curved_array_.id());
  const auto triangles = static_cast<GLsizei>(made_.triangles.size());
  if (plain())
    glDrawArrays(GL_TRIANGLES, 0, 3 * triangles);
  else
    glDrawArraysInstanced(GL_TRIANGLES, 0, pattern_vertices_, triangles);
  glDisable(GL_CULL_FACE);
}

}  // namespace palpate
