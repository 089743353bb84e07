#include "client/view/png.hpp"

#include <png.h>

#include <stdexcept>
#include <string>

#include "common/base/error.hpp"

namespace palpate {

void write_png(const std::filesystem::path& file, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  constexpr int kMostLinks = 40;  // limit for chained links, as in the system
  // Links are followed, and only a regular file is replaced.
  std::error_code error;
  std::filesystem::path real = file;
  for (int links = 0; links < kMostLinks && std::filesystem::is_symlink(real, error); ++links)
    real = real.parent_path() / std::filesystem::read_symlink(real, error);
  if (std::filesystem::exists(real, error) && !std::filesystem::is_regular_file(real, error))
    throw InputError(file.string(), "is there, and no regular file", "a file to write the picture to");
  const std::filesystem::path part = real.string() + ".part";
  if (png_image_write_to_file(&image, part.c_str(), 0, picture.rgb.data(), 0, nullptr) == 0) {
    std::filesystem::remove(part, error);
    throw std::runtime_error(file.string() + ": picture not written: " + image.message);
  }
  std::filesystem::rename(part, real, error);
  if (error) throw std::runtime_error(file.string() + ": picture not written: " + error.message());
}

}  // namespace palpate
