#include "client/view/solid_batch.hpp"

#include <epoxy/gl.h>

#include <utility>

#include "client/viewer/color.hpp"

namespace palpate {
namespace {

Stylus stylus_of(const ToolView& tool, float tip_radius, const Vec3f& color) {
  Stylus stylus{tool.position.cast<float>(), tip_radius, color, {}, tool.buttons != 0};
  if (tool.orientation) stylus.axes = tool.orientation->normalized().toRotationMatrix().cast<float>();
  return stylus;
}

}  // namespace

SolidBatch::SolidBatch() {
  constexpr int kFloats = sizeof(SolidVertex) / sizeof(float);
  static_assert(kFloats == 10, "SolidVertex is ten packed floats");
  for (const auto& [array, buffer] : {std::pair(&array_, &buffer_), std::pair(&parts_array_, &parts_buffer_)}) {
    glBindVertexArray(array->id());
    glBindBuffer(GL_ARRAY_BUFFER, buffer->id());
    for (GLuint i = 0; i < 3; ++i) attribute(i, 3, kFloats, 3 * static_cast<int>(i));
    attribute(3, 1, kFloats, 9);
  }
}

bool SolidBatch::show(const Sight& sight, const Box& rest) {
  next_.clear();
  const float tip = tip_radius(rest);
  for (std::size_t i = 0; i < sight.tools.size(); ++i) {
    const ToolView& tool = sight.tools[i];
    if (i >= sight.shapes.size() || sight.shapes[i].empty())
      append_stylus(next_, stylus_of(tool, tip, station_color(sight.hue(i))));
    else
      append_instrument(next_, {{tool.position, tool.orientation.value_or(Rotation::Identity()), tool.opening},
                                sight.shapes[i],
                                station_color(sight.hue(i))});
  }
  arrows_from_ = next_.size();
  for (std::size_t i = 0; i < sight.tools.size(); ++i) {
    const ToolView& tool = sight.tools[i];
    const Vec3f at = tool.position.cast<float>(), force = tool.force.cast<float>();
    if (tool.contact) append_arrow(next_, at, sight.arrow_m_per_n * force, 1.1F * tip, station_color(sight.hue(i)));
  }
  const bool parts_changed = sight.parts_version != parts_version_;
  if (parts_changed) {
    parts_version_ = sight.parts_version;
    SolidMesh parts;
    for (const PartMesh& part : sight.parts) append_part(parts, part);
    parts_vertices_ = parts.size();
    upload(parts_buffer_, std::as_bytes(std::span(parts)));
  }
  if (next_ == solids_) return parts_changed;
  std::swap(next_, solids_);
  upload(buffer_, std::as_bytes(std::span(solids_)));
  return true;
}

void SolidBatch::draw() const {
  glBindVertexArray(array_.id());
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(solids_.size()));
  glBindVertexArray(parts_array_.id());
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(parts_vertices_));
}

void SolidBatch::draw_arrows() const {
  glBindVertexArray(array_.id());
  glDrawArrays(GL_TRIANGLES, static_cast<GLint>(arrows_from_), static_cast<GLsizei>(solids_.size() - arrows_from_));
}

}  // namespace palpate
