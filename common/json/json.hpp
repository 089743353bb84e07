// JSON as a tree that remembers the line of every value, so that an error can point at it.
//
// Strict RFC 8259: no comments, no trailing commas, no NaN; a key that appears twice in one object is refused.
// Throws InputError with "FILE:LINE".
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

struct Json {
  enum class Kind { null, boolean, number, string, array, object };

  Kind kind = Kind::null;
  int line = 1;
  std::string key;          ///< when this is a member of an object
  std::string text;         ///< number: as written; string: decoded; boolean: true or false
  std::vector<Json> items;  ///< elements of an array or members of an object, in order

  const Json* find(std::string_view name) const;

  static Json object() { return of(Kind::object, {}); }
  static Json array() { return of(Kind::array, {}); }
  static Json string(std::string value) { return of(Kind::string, std::move(value)); }
  /// Returns a number as the shortest text that reads back as the same double.
  static Json number(double value);
  static Json of(Kind kind, std::string text);
  /// Appends a member to an object.
  Json& add(std::string name, Json value);
};

Json parse_json(std::string_view text, const std::string& file);

/// Writes with two spaces per level; arrays of plain values stay on one line.
std::string write_json(const Json& value);

/// Returns a name for messages, for example "a number", "a list".
const char* describe(Json::Kind kind);

}  // namespace palpate
