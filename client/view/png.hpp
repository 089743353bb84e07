// A picture in memory and on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace palpate {

/// 8-bit sRGB, three bytes a pixel, top row first.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Throws std::runtime_error naming the file and the reason when it cannot be written. The file appears complete or not at all.
void write_png(const std::filesystem::path& file, const Picture& picture);

}  // namespace palpate
