#include "client/view/overlay.hpp"

#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "client/view/ground.hpp"
#include "client/view/patch_overlay.hpp"
#include "client/view/pen.hpp"
#include "client/view/round_125.hpp"
#include "client/view/solid_batch.hpp"
#include "client/view/task_overlay.hpp"

namespace palpate {
namespace {

/// Returns the force on a tool, the torque on one with a body, and its depth.
std::string felt(const Sight& sight, std::size_t i, int digits) {
  std::string force = fmt::format("{:.{}f} N", sight.tools[i].force.norm(), digits);
  if (const double torque_nm = sight.tools[i].torque.norm(); torque_nm > 0)
    force += fmt::format(", {:.0f} mN m", 1e3 * torque_nm);
  return sight.depth(i) < 5e-5F ? force : force + fmt::format(", {:.1f} mm deep", 1e3F * sight.depth(i));
}

/// Returns the lower end of what it draws.
float draw_head(const Pen& pen, const Sight& sight, const Caption& caption) {
  const float left = 28 * pen.scale;
  float y = 22 * pen.scale;
  pen.text(left, y, 24, pen.theme.ink, caption.title);
  y += 33 * pen.scale;
  if (!caption.status.empty()) {
    pen.text(left, y, 14, pen.theme.ink_soft, caption.status);
    y += 30 * pen.scale;
  }
  for (std::size_t i = 0; i < sight.tools.size() && i < 8; ++i) {
    const ToolView& tool = sight.tools[i];
    const float r = 5 * pen.scale, cy = y + 8.5F * pen.scale;
    if (tool.contact) {
      pen.list.AddCircleFilled({left + r, cy}, r, packed(station_color(sight.hue(i))), 24);
    } else {
      pen.list.AddCircle({left + r, cy}, r - 0.5F * pen.scale, packed(station_color(sight.hue(i))), 24, 1.6F * pen.scale);
    }
    const float x = left + 18 * pen.scale + pen.text(left + 18 * pen.scale, y, 15, pen.theme.ink, tool.station);
    std::string state = tool.contact ? felt(sight, i, 2) : std::string("free");
    if (!tool.guides.empty()) state += ", guides " + tool.guides;
    pen.text(x + 9 * pen.scale, y, 15, pen.theme.ink_soft, state);
    y += 23 * pen.scale;
  }
  return y;
}

void draw_label(const Pen& pen, const std::string& words, float x, float y) {
  const float w = pen.measure(16, words), pad = 6 * pen.scale;
  // Text wider than the picture begins at its left edge.
  x = std::max(pad, std::min(x, pen.width - w - pad));
  y = std::max(pad, std::min(y, pen.height - 24 * pen.scale));
  pen.list.AddRectFilled({x - pad, y - 2.5F * pen.scale}, {x + w + pad, y + 20 * pen.scale},
                         packed(pen.theme.background_bottom, 0.80F), 5 * pen.scale);
  pen.text(x, y, 16, pen.theme.ink, words);
}

/// Draws a line from each tool that guides to the tool that it guides, with an arrow head in the middle.
void draw_guidance(const Pen& pen, const Sight& sight, const Camera& camera) {
  const Eigen::Matrix4f view_projection = camera.projection(pen.width / pen.height) * camera.view();
  for (std::size_t i = 0; i < sight.tools.size(); ++i) {
    const ToolView& guide = sight.tools[i];
    const auto guided = std::ranges::find(sight.tools, guide.guides, &ToolView::station);
    if (guide.guides.empty() || guided == sight.tools.end()) continue;
    const Vec3f from = to_pixels(view_projection, guide.position.cast<float>(), pen.width, pen.height);
    const Vec3f to = to_pixels(view_projection, guided->position.cast<float>(), pen.width, pen.height);
    if (from.z() > 1 || to.z() > 1) continue;
    const ImU32 color = packed(station_color(sight.hue(i)));
    pen.list.AddLine({from.x(), from.y()}, {to.x(), to.y()}, packed(Vec3f::Ones(), 0.6F), 5.0F * pen.scale);
    pen.list.AddLine({from.x(), from.y()}, {to.x(), to.y()}, color, 2.4F * pen.scale);
    const Eigen::Vector2f way = (to - from).head<2>();
    const float side = 6 * pen.scale;
    if (way.norm() < 4 * side) continue;
    const Eigen::Vector2f along = way.normalized(), across(-along.y(), along.x());
    const Eigen::Vector2f tip = from.head<2>() + 0.5F * way + side * along, foot = tip - 2 * side * along;
    const Eigen::Vector2f left = foot + side * across, right = foot - side * across;
    pen.list.AddTriangleFilled({tip.x(), tip.y()}, {left.x(), left.y()}, {right.x(), right.y()}, color);
  }
}

void draw_contacts(const Pen& pen, const Sight& sight, const Camera& camera) {
  const Eigen::Matrix4f view_projection = camera.projection(pen.width / pen.height) * camera.view();
  const Box rest = bounds(sight.triangles, sight.rest);
  for (std::size_t i = 0; i < sight.tools.size(); ++i) {
    const ToolView& tool = sight.tools[i];
    if (!tool.contact) continue;
    const Vec3f at = to_pixels(view_projection, tool.position.cast<float>(), pen.width, pen.height);
    const Vec3f end =
        to_pixels(view_projection, (tool.position + sight.arrow_m_per_n * tool.force).cast<float>(), pen.width, pen.height);
    if (at.z() > 1) continue;
    const Vec3f beside = tool.position.cast<float>() + 1.6F * SolidBatch::tip_radius(rest) * camera.axes().col(0);
    const float ring = to_pixels(view_projection, beside, pen.width, pen.height).x() - at.x();
    pen.list.AddCircle({at.x(), at.y()}, ring, packed(Vec3f::Ones(), 0.45F), 48, 3.0F * pen.scale);
    pen.list.AddCircle({at.x(), at.y()}, ring, packed(station_color(sight.hue(i)), 0.8F), 48, 1.4F * pen.scale);
    if (end.z() > 1) continue;
    const std::string words = felt(sight, i, 1);
    // Place the label next to the arrow's head, on the side away from the instrument, which leans to the right.
    draw_label(pen, words, end.x() - pen.measure(16, words) - 16 * pen.scale, end.y() - 12 * pen.scale);
  }
}

struct Legend {
  const char* title;
  float per_unit;  ///< numbers on the legend per unit of the sight
  const char* unit;
};
Legend legend_of(ShapeChannel color) {
  switch (color) {
    case ShapeChannel::tension:
      return {"largest force in an element", 1, "N"};
    case ShapeChannel::support:
      return {"reach of the local patches", 100, "%"};
    case ShapeChannel::stress:
      return {"von Mises stress", 1e-3F, "kPa"};
    case ShapeChannel::strain:
      return {"largest principal strain", 100, "%"};
    case ShapeChannel::pressure:
      return {"pressure", 1e-3F, "kPa"};
    case ShapeChannel::position:
      break;
  }
  return {"displacement", 1000, "mm"};
}

/// Draws a bar of colours whose ends stand for `from` and `to`, with a mark each `step`; `row` 0 is the lowest.
template <class Color>
void draw_color_bar(const Pen& pen, int row, const std::string& title, float from, float to, float step, const char* unit,
                    const Color& color) {
  constexpr int kParts = 64;
  const float x = 28 * pen.scale, bar = 210 * pen.scale, thick = 11 * pen.scale;
  const float y = pen.bottom - (52 + 64 * static_cast<float>(row)) * pen.scale;
  pen.text(x, y - 24 * pen.scale, 14, pen.theme.ink, title);
  for (int i = 0; i < kParts; ++i) {
    const auto at = [&](int k) { return x + bar * static_cast<float>(k) / kParts; };
    pen.list.AddRectFilled({at(i), y}, {at(i + 1), y + thick}, packed(color((static_cast<float>(i) + 0.5F) / kParts)));
  }
  const int marks = static_cast<int>(std::lround((to - from) / step));
  for (int i = 0; i <= marks; ++i) {
    const float value = from + static_cast<float>(i) * step, centre = x + bar * static_cast<float>(i) / static_cast<float>(marks);
    const std::string number = fmt::format("{:.4g}", value);
    pen.list.AddLine({centre, y + thick}, {centre, y + thick + 4 * pen.scale}, packed(pen.theme.ink_soft), pen.scale);
    pen.text(i == 0 ? x : centre - 0.5F * pen.measure(13, number), y + thick + 6 * pen.scale, 13, pen.theme.ink_soft,
             i == marks ? number + " " + unit : number);
  }
}

/// Draws the colours of fixed parts and of walls of cuts, next to the lowest bar.
void draw_kinds(const Pen& pen, const Sight& sight) {
  const float x = 292 * pen.scale, side = 11 * pen.scale;
  float y = pen.bottom - 52 * pen.scale;
  const auto draw = [&](bool MeshVertex::*is, const Vec3f& color, const char* name) {
    if (std::ranges::none_of(sight.vertices, is)) return;
    pen.list.AddRectFilled({x, y}, {x + side, y + side}, packed(to_srgb(color)), 2 * pen.scale);
    pen.text(x + side + 7 * pen.scale, y - 3 * pen.scale, 13, pen.theme.ink_soft, name);
    y += 20 * pen.scale;
  };
  draw(&MeshVertex::fixed, held_color(), "held fast");
  draw(&MeshVertex::wall, wall_color(), "cut");
}

void draw_legends(const Pen& pen, const Sight& sight, const Look& look) {
  const Legend legend = legend_of(sight.color);
  const float step = legend.per_unit * contour_step(sight.color_max);
  draw_color_bar(pen, 0, fmt::format("{}, a line each {:.3g} {}", legend.title, step, legend.unit), 0,
                 legend.per_unit * sight.color_max, step, legend.unit, &displacement_color);
  draw_kinds(pen, sight);
  int row = 1;
  if (look.lines == Lines::strain)
    draw_color_bar(pen, row++, "strain of the edges", -100 * kStrainMax, 100 * kStrainMax, 100 * kStrainMax, "%",
                   [](float share) { return strain_color(2 * share - 1); });
  if (!sight.pins.empty())
    draw_color_bar(pen, row, fmt::format("the patch beside the next frame, lines x{:g}", miss_magnification(sight)), 0,
                   1000 * sight.miss_max_m, 500 * sight.miss_max_m, "mm", &miss_color);
}

/// Draws a bar of the force, and of the floor's grid, as long as an arrow or a cell is at the body's middle.
void draw_scales(const Pen& pen, const Sight& sight, const Camera& camera, const Caption& caption) {
  if (sight.triangles.empty()) return;
  const Eigen::Matrix4f view_projection = camera.projection(pen.width / pen.height) * camera.view();
  const Box rest = bounds(sight.triangles, sight.rest);
  const auto pixels = [&](float metres) {
    const Vec3f beside = rest.center() + metres * camera.axes().col(0);
    return to_pixels(view_projection, beside, pen.width, pen.height).x() -
           to_pixels(view_projection, rest.center(), pen.width, pen.height).x();
  };
  const float grid_m = Ground::grid_spacing(rest.diagonal()),
              force_n = round_down_125(0.3F * rest.diagonal() / sight.arrow_m_per_n);
  float right = pen.width - 28 * pen.scale;
  const auto bar = [&](float length, const std::string& words) {
    const float y = pen.bottom - 40 * pen.scale, left = right - std::max(length, pen.measure(13, words));
    const float thick = 1.6F * pen.scale, tick = 4 * pen.scale;
    const ImU32 ink = packed(pen.theme.ink);
    pen.list.AddLine({right - length, y}, {right, y}, ink, thick);
    for (const float x : {right - length, right}) pen.list.AddLine({x, y - tick}, {x, y + tick}, ink, thick);
    pen.text_left_of(right, y + 7 * pen.scale, 13, pen.theme.ink_soft, words);
    right = left - 26 * pen.scale;
  };
  bar(pixels(grid_m), fmt::format("{:g} mm", 1000 * grid_m));
  bar(pixels(force_n * sight.arrow_m_per_n), fmt::format("{:g} N", force_n));
  if (caption.keys.empty()) return;
  pen.text_left_of(pen.width - 28 * pen.scale, pen.bottom - 70 * pen.scale, 12, pen.theme.ink_soft, caption.keys);
}

}  // namespace

Overlay::Overlay(float scale) : scale_(scale) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  std::error_code error;
  const float pixels = std::max(10.0F, 18 * scale);
  if (std::filesystem::exists(PALPATE_VIEW_FONT, error)) {
    ImFontConfig config;
    config.OversampleH = config.OversampleV = 3;
    io.Fonts->AddFontFromFileTTF(PALPATE_VIEW_FONT, pixels, &config);
  } else {
    io.Fonts->AddFontDefault();
  }
  if (!ImGui_ImplOpenGL3_Init("#version 330 core")) throw std::runtime_error("Dear ImGui found no OpenGL 3.3");
}

Overlay::~Overlay() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

void Overlay::draw(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width, int height) {
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
  io.DeltaTime = 1.0F / 60;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  const float below = caption.replay ? ReplayBar::kHeight * scale_ : 0;
  const Pen pen{*ImGui::GetForegroundDrawList(), theme(look.dark), scale_, io.DisplaySize.x, io.DisplaySize.y,
                io.DisplaySize.y - below};
  const bool has_task = caption.task != nullptr && caption.task->task() != nullptr;
  if (has_task) draw_task_target(pen, *caption.task, camera);
  const float below_head = draw_head(pen, sight, caption);
  if (has_task) draw_task(pen, sight, *caption.task, 28 * pen.scale, below_head + 8 * pen.scale);
  draw_patch(pen, sight, camera);
  draw_guidance(pen, sight, camera);
  draw_contacts(pen, sight, camera);
  draw_legends(pen, sight, look);
  draw_scales(pen, sight, camera, caption);
  if (look.panels) draw_panels(pen, caption.panels);
  if (caption.replay) draw_replay_bar(pen, *caption.replay);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace palpate
