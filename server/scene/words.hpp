// A text file word by word, with the number of the line in errors. Nothing that it hands out is larger than what is left of the
// text: a count of things to come is refused where the text has no room for them, before anything is allocated.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

class Words {
 public:
  /// `text` outlives it; `where` begins every error.
  Words(std::string_view text, std::string where) : rest_(text), where_(std::move(where)) {}

  /// False at the end of the text. The word lies in the text.
  bool next(std::string_view& word);
  /// False at the end of the line, which stays to be skipped. A backslash at its end goes on in the next one.
  bool next_on_line(std::string_view& word);

  // Each throws InputError where the text has no such thing.
  std::string_view word();
  double number();
  int whole();
  /// A whole number from 0 to `most`.
  std::size_t index(std::size_t most);
  /// The number of things to come, of which each takes two bytes at least.
  std::size_t count(std::size_t most);
  void skip(std::size_t words);
  void skip_line();
  /// Of a word that was taken before.
  double number_in(std::string_view word) const;

  [[noreturn]] void fail(const std::string& what, const std::string& expected) const;

 private:
  std::string_view rest_;
  std::string where_;
  std::size_t line_ = 1;
};

}  // namespace palpate
