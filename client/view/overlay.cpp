#include "client/view/overlay.hpp"

#include <backends/imgui_impl_opengl3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace palpate {
namespace {

ImU32 packed(const Vec3f& srgb, float alpha = 1.0F) {
  return ImGui::ColorConvertFloat4ToU32({srgb.x(), srgb.y(), srgb.z(), alpha});
}

/// The pen of one picture: sizes in units of the interface scale, colours of the theme.
struct Pen {
  ImDrawList& list;
  const Theme& theme;
  float scale, width, height;

  float text(float x, float y, float size, const Vec3f& color, const std::string& words) const {
    list.AddText(ImGui::GetFont(), size * scale, {x, y}, packed(color), words.c_str());
    return measure(size, words);
  }
  float measure(float size, const std::string& words) const {
    return ImGui::GetFont()->CalcTextSizeA(size * scale, 1e9F, 0, words.c_str()).x;
  }
};

void draw_head(const Pen& pen, const Sight& sight, const Caption& caption) {
  const float left = 28 * pen.scale;
  float y = 22 * pen.scale;
  pen.text(left, y, 24, pen.theme.ink, caption.title);
  y += 33 * pen.scale;
  pen.text(left, y, 14, pen.theme.ink_soft, caption.status);
  y += 30 * pen.scale;
  for (std::size_t i = 0; i < sight.tools.size() && i < 8; ++i) {
    const ToolView& tool = sight.tools[i];
    const float r = 5 * pen.scale, cy = y + 8.5F * pen.scale;
    if (tool.contact) {
      pen.list.AddCircleFilled({left + r, cy}, r, packed(station_color(i)), 24);
    } else {
      pen.list.AddCircle({left + r, cy}, r - 0.5F * pen.scale, packed(station_color(i)), 24, 1.6F * pen.scale);
    }
    const float x = left + 18 * pen.scale + pen.text(left + 18 * pen.scale, y, 15, pen.theme.ink, tool.station);
    pen.text(x + 9 * pen.scale, y, 15, pen.theme.ink_soft,
             tool.contact ? fmt::format("{:.2f} N", tool.force.norm()) : std::string("free"));
    y += 23 * pen.scale;
  }
}

void draw_label(const Pen& pen, const std::string& words, float x, float y) {
  const float w = pen.measure(16, words), pad = 6 * pen.scale;
  x = std::clamp(x, pad, pen.width - w - pad);
  y = std::clamp(y, pad, pen.height - 24 * pen.scale);
  pen.list.AddRectFilled({x - pad, y - 2.5F * pen.scale}, {x + w + pad, y + 20 * pen.scale},
                         packed(pen.theme.background_bottom, 0.80F), 5 * pen.scale);
  pen.text(x, y, 16, pen.theme.ink, words);
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
    const Vec3f beside = tool.position.cast<float>() + 1.6F * Renderer::tip_radius(rest) * camera.axes().col(0);
    const float ring = to_pixels(view_projection, beside, pen.width, pen.height).x() - at.x();
    pen.list.AddCircle({at.x(), at.y()}, ring, packed(Vec3f::Ones(), 0.45F), 48, 3.0F * pen.scale);
    pen.list.AddCircle({at.x(), at.y()}, ring, packed(station_color(i), 0.8F), 48, 1.4F * pen.scale);
    if (end.z() > 1) continue;
    const std::string words = fmt::format("{:.1f} N", tool.force.norm());
    // Beside the arrow's head, on the side away from the instrument, which leans to the right.
    draw_label(pen, words, end.x() - pen.measure(16, words) - 16 * pen.scale, end.y() - 12 * pen.scale);
  }
}

void draw_legend(const Pen& pen, const Sight& sight) {
  constexpr int kParts = 64;
  const float x = 28 * pen.scale, bar = 210 * pen.scale, thick = 11 * pen.scale, y = pen.height - 52 * pen.scale;
  pen.text(x, y - 24 * pen.scale, 14, pen.theme.ink, "displacement since joining");
  for (int i = 0; i < kParts; ++i) {
    const auto at = [&](int k) { return x + bar * static_cast<float>(k) / kParts; };
    pen.list.AddRectFilled({at(i), y}, {at(i + 1), y + thick},
                           packed(displacement_color((static_cast<float>(i) + 0.5F) / kParts)));
  }
  const float max_mm = 1000 * sight.displacement_max_m;
  for (int i = 0; i <= 2; ++i) {
    const std::string words = fmt::format("{:g}{}", 0.5F * static_cast<float>(i) * max_mm, i == 2 ? " mm" : "");
    const float centre = x + bar * 0.5F * static_cast<float>(i);
    const float w = pen.measure(13, fmt::format("{:g}", 0.5F * static_cast<float>(i) * max_mm));
    pen.list.AddLine({centre, y + thick}, {centre, y + thick + 4 * pen.scale}, packed(pen.theme.ink_soft), pen.scale);
    pen.text(i == 0 ? x : centre - 0.5F * w, y + thick + 6 * pen.scale, 13, pen.theme.ink_soft, words);
  }
}

void draw_scales(const Pen& pen, const Sight& sight, const Caption& caption) {
  const Box rest = bounds(sight.triangles, sight.rest);
  const std::string words =
      fmt::format("grid {:g} mm    force {:g} mm per N", 1000 * Renderer::grid_spacing(rest), 1000 * sight.arrow_m_per_n);
  const float right = pen.width - 28 * pen.scale;
  pen.text(right - pen.measure(13, words), pen.height - 35 * pen.scale, 13, pen.theme.ink_soft, words);
  if (!caption.keys.empty()) {
    pen.text(right - pen.measure(13, caption.keys), pen.height - 57 * pen.scale, 13, pen.theme.ink_soft, caption.keys);
  }
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

void Overlay::draw(const Sight& sight, const Caption& caption, const Camera& camera, bool dark, int width, int height) {
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
  io.DeltaTime = 1.0F / 60;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  const Pen pen{*ImGui::GetForegroundDrawList(), theme(dark), scale_, io.DisplaySize.x, io.DisplaySize.y};
  draw_head(pen, sight, caption);
  draw_contacts(pen, sight, camera);
  draw_legend(pen, sight);
  draw_scales(pen, sight, caption);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace palpate
