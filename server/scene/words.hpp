// Reads a text file word by word, with line numbers in errors. No result is larger than the remaining text: a count of items is
// refused before allocation if the text has no room for them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

class Words {
 public:
  /// `text` must outlive this object; `where` begins every error.
  Words(std::string_view text, std::string where) : rest_(text), where_(std::move(where)) {}

  /// Returns false at the end of the text. The word is a view into the text.
  bool next(std::string_view& word);
  /// Returns false at the end of the line, which remains to be skipped. A backslash at its end continues the line.
  bool next_on_line(std::string_view& word);

  // Each throws InputError if the text has no such item.
  std::string_view word();
  double number();
  int whole();
  /// A whole number from 0 to `most`.
  std::size_t index(std::size_t most);
  /// A number of following items, each of which occupies at least two bytes.
  std::size_t count(std::size_t most);
  void skip(std::size_t words);
  void skip_line();
  /// Converts a word that was read before.
  double number_in(std::string_view word) const;

  [[noreturn]] void fail(const std::string& what, const std::string& expected) const;

 private:
  std::string_view rest_;
  std::string where_;
  std::size_t line_ = 1;
};

}  // namespace palpate
