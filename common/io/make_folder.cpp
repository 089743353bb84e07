#include "common/io/make_folder.hpp"

#include <system_error>

#include "common/base/error.hpp"

namespace palpate {

void make_folder(const std::string& where, const std::filesystem::path& folder) {
  if (folder.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (std::filesystem::is_directory(folder)) return;
  if (!error) error = std::make_error_code(std::errc::not_a_directory);
  throw InputError(where, "folder " + folder.string() + " cannot be made: " + error.message(), "a folder that can be written to");
}

}  // namespace palpate
