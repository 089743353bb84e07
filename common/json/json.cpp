#include "common/json/json.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"

namespace palpate {

namespace {

constexpr int kMaxDepth = 32;
constexpr std::size_t kMaxFields = 1'000;  // each is compared with those before it

class Scanner {
 public:
  Scanner(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  Json document() {
    Json value = this->value(0);
    skip_space();
    if (at_ < text_.size()) fail("something follows the end of the document", "the end of the file");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& expected) const {
    throw InputError(file_ + ":" + std::to_string(line_), what, expected);
  }

  /// Describes the text at the cursor.
  std::string here() const {
    if (at_ >= text_.size()) return "the file ends early";
    if (static_cast<unsigned char>(text_[at_]) < 0x20) return "a control character is in the text";
    return in_quotes(text_.substr(at_, std::max<std::size_t>(1, character_bytes(text_.substr(at_)))), '\'') + " is out of place";
  }

  void skip_space() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n') ++line_;
      if (c != ' ' && c != '\t' && c != '\r' && c != '\n') return;
    }
  }

  bool next_is(char c) {
    skip_space();
    return at_ < text_.size() && text_[at_] == c;
  }

  bool accept(char c) {
    if (!next_is(c)) return false;
    ++at_;
    return true;
  }

  Json value(int depth) {
    if (depth > kMaxDepth) fail("values are nested too deep", "at most " + std::to_string(kMaxDepth) + " levels");
    skip_space();
    Json json;
    json.line = line_;
    const char c = at_ < text_.size() ? text_[at_] : '\0';
    if (c == '{') {
      object(json, depth);
    } else if (c == '[') {
      array(json, depth);
    } else if (c == '"') {
      json.kind = Json::Kind::string;
      json.text = string();
    } else if (c == '-' || (c >= '0' && c <= '9')) {
      number(json);
    } else {
      word(json);
    }
    return json;
  }

  void object(Json& json, int depth) {
    json.kind = Json::Kind::object;
    ++at_;
    if (accept('}')) return;
    do {
      if (!next_is('"')) fail(here(), "a field name in double quotes");
      const int line = line_;
      std::string key = string();
      if (const Json* twin = json.find(key)) {
        fail("field " + in_quotes(key) + " is given twice, first in line " + std::to_string(twin->line), "each field once");
      }
      if (!accept(':')) fail(here(), "':' after " + in_quotes(key));
      Json member = value(depth + 1);
      member.line = line;
      member.key = std::move(key);
      if (json.items.size() == kMaxFields) fail("an object has too many fields", "at most " + std::to_string(kMaxFields));
      json.items.push_back(std::move(member));
    } while (accept(','));
    if (!accept('}')) fail(here(), "',' or '}' after a field");
  }

  void array(Json& json, int depth) {
    json.kind = Json::Kind::array;
    ++at_;
    if (accept(']')) return;
    do json.items.push_back(value(depth + 1));
    while (accept(','));
    if (!accept(']')) fail(here(), "',' or ']' after a list element");
  }

  void digits() {
    const auto start = at_;
    while (at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9') ++at_;
    if (at_ == start) fail(here(), "a digit");
  }

  void number(Json& json) {
    json.kind = Json::Kind::number;
    const auto start = at_;
    if (text_[at_] == '-') ++at_;
    if (at_ < text_.size() && text_[at_] == '0') {
      ++at_;
    } else {
      digits();
    }
    if (at_ < text_.size() && text_[at_] == '.') {
      ++at_;
      digits();
    }
    if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
      ++at_;
      if (at_ < text_.size() && (text_[at_] == '+' || text_[at_] == '-')) ++at_;
      digits();
    }
    json.text = std::string(text_.substr(start, at_ - start));
  }

  void word(Json& json) {
    auto end = at_;
    while (end < text_.size() && std::isalpha(static_cast<unsigned char>(text_[end]))) ++end;
    const std::string word(text_.substr(at_, end - at_));
    if (word == "true" || word == "false") {
      json.kind = Json::Kind::boolean;
      json.text = word;
    } else if (word != "null") {
      fail(word.empty() ? here() : in_quotes(word, '\'') + " is not a value",
           "a number, a text in double quotes, a list or an object");
    }
    at_ = end;
  }

  std::string string() {
    std::string out;
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      const auto c = static_cast<unsigned char>(text_[at_]);
      if (c < 0x20) fail("a text does not end on its line", "a closing double quote");
      if (c == '\\') {
        escape(out);
      } else {
        out += text_[at_];
      }
    }
    if (at_ >= text_.size()) fail("the file ends inside a text", "a closing double quote");
    ++at_;
    return out;
  }

  void escape(std::string& out) {
    constexpr std::string_view kNames = "\"\\/bfnrt", kValues = "\"\\/\b\f\n\r\t";
    const char c = ++at_ < text_.size() ? text_[at_] : '\0';
    if (const auto i = kNames.find(c); i != kNames.npos) {
      out += kValues[i];
      return;
    }
    std::uint32_t code = 0;
    const char* first = text_.data() + at_ + 1;
    if (c != 'u' || text_.size() - at_ < 5 || std::from_chars(first, first + 4, code, 16).ptr != first + 4) {
      fail("a text holds an unknown escape", "one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX");
    }
    if (code >= 0xD800 && code < 0xE000) fail("a text holds a surrogate escape", "the character itself in UTF-8");
    at_ += 4;
    utf8(out, code);
  }

  static void utf8(std::string& out, std::uint32_t code) {
    if (code < 0x80) {
      out += static_cast<char>(code);
    } else if (code < 0x800) {
      out += static_cast<char>(0xC0 | (code >> 6));
      out += static_cast<char>(0x80 | (code & 0x3F));
    } else {
      out += static_cast<char>(0xE0 | (code >> 12));
      out += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
      out += static_cast<char>(0x80 | (code & 0x3F));
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

const Json* Json::find(std::string_view name) const {
  if (kind != Kind::object) return nullptr;
  for (const Json& item : items) {
    if (item.key == name) return &item;
  }
  return nullptr;
}

Json Json::of(Kind kind, std::string text) {
  Json json;
  json.kind = kind;
  json.text = std::move(text);
  return json;
}

Json Json::number(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return of(Kind::number, std::string(text, end));
}

Json& Json::add(std::string name, Json value) {
  value.key = std::move(name);
  items.push_back(std::move(value));
  return items.back();
}

Json parse_json(std::string_view text, const std::string& file) { return Scanner(text, file).document(); }

const char* describe(Json::Kind kind) {
  switch (kind) {
    case Json::Kind::null:
      return "null";
    case Json::Kind::boolean:
      return "true or false";
    case Json::Kind::number:
      return "a number";
    case Json::Kind::string:
      return "a text";
    case Json::Kind::array:
      return "a list";
    case Json::Kind::object:
      return "an object";
  }
  return "a value";
}

}  // namespace palpate
