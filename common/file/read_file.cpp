#include "common/file/read_file.hpp"

#include <cerrno>
#include <fstream>
#include <string_view>
#include <system_error>

#include "common/base/error.hpp"

namespace palpate {
namespace {

std::string in_words(std::errc fault) { return std::make_error_code(fault).message(); }

/// Returns the reason for which the file at that place must not be read; empty when it may be.
std::string objection(const std::filesystem::path& file) {
  std::error_code fault;
  const auto type = std::filesystem::status(file, fault).type();
  if (type == std::filesystem::file_type::not_found) return in_words(std::errc::no_such_file_or_directory);
  if (type == std::filesystem::file_type::none) return fault.message();
  if (type == std::filesystem::file_type::directory) return in_words(std::errc::is_a_directory);
  const bool device = type == std::filesystem::file_type::character || type == std::filesystem::file_type::block;
  return device ? "it is a device" : "";
}

}  // namespace

std::string read_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                      std::size_t most) {
  const auto refuse = [&](const std::string& why) { throw InputError(where, "cannot be read (" + why + ")", expected); };
  if (const std::string why = objection(file); !why.empty()) refuse(why);
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse(std::generic_category().message(errno));
  constexpr std::size_t kPiece = 1u << 16;
  std::string text;
  while (in && text.size() <= most) {
    const std::size_t before = text.size();
    text.resize(before + kPiece);
    in.read(text.data() + before, kPiece);
    text.resize(before + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) refuse(in_words(std::errc::io_error));
  if (text.size() > most) throw InputError(where, "is too long", "at most " + std::to_string(most) + " bytes");
  return text;
}

std::string read_plain_file(const std::filesystem::path& file, const std::string& where, const std::string& expected,
                            std::size_t most) {
  std::error_code ignored;
  if (objection(file).empty() && !std::filesystem::is_regular_file(file, ignored))
    throw InputError(where, "cannot be read (it is no regular file)", expected);
  return read_file(file, where, expected, most);
}

std::string without_mark(std::string text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.starts_with(kMark)) text.erase(0, kMark.size());
  return text;
}

}  // namespace palpate
