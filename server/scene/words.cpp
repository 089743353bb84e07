#include "server/scene/words.hpp"

#include <charconv>
#include <cmath>
#include <cstdlib>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"

namespace palpate {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// True where a line of `text` ends, which is with \n, \r\n or, as on old machines, \r alone.
bool ends_line(std::string_view text) { return text.starts_with('\n') || (text.starts_with('\r') && !text.starts_with("\r\n")); }

std::size_t word_length(std::string_view text) {
  std::size_t length = 0;
  while (length < text.size() && !is_blank(text[length]) && text[length] != '\n') ++length;
  return length;
}

}  // namespace

bool Words::next(std::string_view& word) {
  while (!rest_.empty() && (is_blank(rest_.front()) || rest_.front() == '\n')) {
    line_ += ends_line(rest_);
    rest_.remove_prefix(1);
  }
  word = rest_.substr(0, word_length(rest_));
  rest_.remove_prefix(word.size());
  return !word.empty();
}

bool Words::next_on_line(std::string_view& word) {
  while (!rest_.empty()) {
    const std::size_t joined = rest_.starts_with("\\\r\n") ? 3 : rest_.starts_with("\\\n") || rest_.starts_with("\\\r") ? 2 : 0;
    if (joined == 0 && (!is_blank(rest_.front()) || ends_line(rest_))) break;
    line_ += joined > 0;
    rest_.remove_prefix(joined > 0 ? joined : 1);
  }
  word = rest_.substr(0, word_length(rest_));
  rest_.remove_prefix(word.size());
  return !word.empty();
}

std::string_view Words::word() {
  std::string_view w;
  if (!next(w)) fail("ends too early", "the rest of the mesh");
  return w;
}

double Words::number_in(std::string_view w) const {
  const std::string_view digits = w.substr(w.starts_with('+') ? 1 : 0);
  double value = 0;
  auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (fault == std::errc::result_out_of_range) {  // also for values that underflow
    value = std::strtod(std::string(digits).c_str(), nullptr);
    fault = {};
  }
  if (fault != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value)) fail(in_quotes(w), "a number");
  return value;
}

double Words::number() { return number_in(word()); }

int Words::whole() {
  const double value = number();
  if (value != std::floor(value) || std::abs(value) > 2e9) fail(std::to_string(value), "a whole number");
  return static_cast<int>(value);
}

std::size_t Words::index(std::size_t most) {
  const double value = number();
  if (value < 0 || value != std::floor(value) || value > static_cast<double>(most))
    fail(std::to_string(value), "a whole number up to " + std::to_string(most));
  return static_cast<std::size_t>(value);
}

std::size_t Words::count(std::size_t most) {
  const std::size_t n = index(most);
  if (n > rest_.size() / 2) fail("a count of " + std::to_string(n) + ", for which the file is too short", "as many as follow");
  return n;
}

void Words::skip(std::size_t words) {
  for (; words > 0; --words) word();
}

void Words::skip_line() {
  while (!rest_.empty() && !ends_line(rest_)) rest_.remove_prefix(1);
  if (!rest_.empty()) rest_.remove_prefix(1);
  ++line_;
}

void Words::fail(const std::string& what, const std::string& expected) const {
  throw InputError(where_ + ":" + std::to_string(line_), what, expected);
}

}  // namespace palpate
