#include "server/scene/file_text.hpp"

#include <fstream>

#include "common/base/error.hpp"

namespace palpate {

std::string read_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                      std::size_t most) {
  std::error_code ignored;
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file, ignored)) throw InputError(where, "cannot be read", expected);
  constexpr std::size_t kPiece = 1u << 16;
  std::string text;
  while (in && text.size() <= most) {
    const std::size_t before = text.size();
    text.resize(before + kPiece);
    in.read(text.data() + before, kPiece);
    text.resize(before + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) throw InputError(where, "cannot be read", expected);
  if (text.size() > most) throw InputError(where, "is too long", "at most " + std::to_string(most) + " bytes");
  return text;
}

std::string read_plain_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                            std::size_t most) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) throw InputError(where, "cannot be read", expected);
  return read_file(file, where, expected, most);
}

}  // namespace palpate
