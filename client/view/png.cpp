#include "client/view/png.hpp"

#include <png.h>

#include <stdexcept>
#include <string>

namespace palpate {

void write_png(const std::filesystem::path& file, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  const std::filesystem::path part = file.string() + ".part";
  std::error_code error;
  if (png_image_write_to_file(&image, part.c_str(), 0, picture.rgb.data(), 0, nullptr) == 0) {
    std::filesystem::remove(part, error);
    throw std::runtime_error(file.string() + ": picture not written: " + image.message);
  }
  std::filesystem::rename(part, file, error);
  if (error) throw std::runtime_error(file.string() + ": picture not written: " + error.message());
}

}  // namespace palpate
