#include "client/view/patch_overlay.hpp"

#include <algorithm>

#include "client/view/pen.hpp"
#include "client/view/round_125.hpp"

namespace palpate {
namespace {

struct Projection {
  Eigen::Matrix4f matrix;
  float width, height;
  Vec3f operator()(const Vec3f& point) const { return to_pixels(matrix, point, width, height); }
};

float cross(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

void draw_triangles(const Pen& pen, const Sight& sight, const std::vector<Vec3f>& at, std::vector<bool>& seen) {
  for (const Triangle& t : sight.pin_triangles) {
    // Pixels count downwards: triangles that are counter-clockwise from outside are clockwise there.
    if (at[t[0]].z() > 1 || cross(at[t[0]], at[t[1]], at[t[2]]) >= 0) continue;
    for (const std::uint32_t i : t) seen[i] = true;
    const auto point = [&](std::size_t k) { return ImVec2(at[t[k]].x(), at[t[k]].y()); };
    pen.list.AddTriangle(point(0), point(1), point(2), packed(Vec3f::Ones(), 0.55F), 1.2F * pen.scale);
  }
}

void draw_pin(const Pen& pen, const Vec3f& from, const Vec3f& to, const Vec3f& color) {
  const ImU32 rim = packed(Vec3f(0.05F, 0.06F, 0.10F), 0.85F), fill = packed(color);
  const ImVec2 a{from.x(), from.y()}, b{to.x(), to.y()};
  pen.list.AddLine(a, b, rim, 4.2F * pen.scale);
  pen.list.AddCircleFilled(a, 4.6F * pen.scale, rim, 20);
  pen.list.AddLine(a, b, fill, 2.2F * pen.scale);
  pen.list.AddCircleFilled(a, 3.4F * pen.scale, fill, 20);
}

}  // namespace

std::vector<PatchPin> pins_on(const Foresight& foresight, std::span<const Vec3f> frame, std::span<const Vec3f> shown) {
  std::vector<PatchPin> pins;
  for (const ForeseenVertex& vertex : foresight.vertices) {
    const Vec3f there = (vertex.compared ? vertex.found : vertex.foreseen).cast<float>();
    const auto nearest = std::min_element(
        frame.begin(), frame.end(), [&](const Vec3f& a, const Vec3f& b) { return (a - there).norm() < (b - there).norm(); });
    const Vec3f at = nearest != frame.end() ? shown[static_cast<std::size_t>(nearest - frame.begin())] : there;
    const Vec3 miss = vertex.compared ? Vec3(vertex.foreseen - vertex.found) : Vec3::Zero();
    pins.push_back({at, miss.cast<float>(), vertex.compared});
  }
  return pins;
}

float miss_magnification(const Sight& sight) {
  return round_down_125(0.05F * bounds(sight.triangles, sight.rest).diagonal() / sight.miss_max_m);
}

void draw_patch(const Pen& pen, const Sight& sight, const Camera& camera) {
  if (sight.pins.empty()) return;
  const Projection project{camera.projection(pen.width / pen.height) * camera.view(), pen.width, pen.height};
  std::vector<Vec3f> at;
  for (const PatchPin& pin : sight.pins) at.push_back(project(pin.at));
  std::vector<bool> seen(at.size(), false);
  draw_triangles(pen, sight, at, seen);
  const float longer = miss_magnification(sight);
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!seen[i] || !sight.pins[i].compared) continue;
    const Vec3f& miss = sight.pins[i].miss;
    draw_pin(pen, at[i], project(sight.pins[i].at + longer * miss), miss_color(miss.norm() / sight.miss_max_m));
  }
}

}  // namespace palpate
