// Text, lines and boxes of one picture: sizes in units of the interface scale, colours of the theme.
#pragma once

#include <imgui.h>

#include <string>

#include "client/viewer/color.hpp"

namespace palpate {

inline ImU32 packed(const Vec3f& srgb, float alpha = 1.0F) {
  return ImGui::ColorConvertFloat4ToU32({srgb.x(), srgb.y(), srgb.z(), alpha});
}

struct Pen {
  ImDrawList& list;
  const Theme& theme;
  float scale, width, height;
  float bottom;  ///< lower limit of text and scales: the lower edge of the picture, or the upper edge of the replay bar

  /// Both return the width of the text.
  float text(float x, float y, float size, const Vec3f& color, const std::string& words) const {
    list.AddText(ImGui::GetFont(), size * scale, {x, y}, packed(color), words.c_str());
    return measure(size, words);
  }
  float measure(float size, const std::string& words) const {
    return ImGui::GetFont()->CalcTextSizeA(size * scale, 1e9F, 0, words.c_str()).x;
  }
  /// Draws text that ends at x.
  void text_left_of(float x, float y, float size, const Vec3f& color, const std::string& words) const {
    text(x - measure(size, words), y, size, color, words);
  }
};

}  // namespace palpate
