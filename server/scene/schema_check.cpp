#include "server/scene/schema_check.hpp"

#include <flatbuffers/idl.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <vector>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"

namespace palpate {

namespace {

/// Edit distance: single-letter insertions, deletions and changes from one word to the other.
std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({change, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

constexpr std::size_t kLongestField = 64;  // longest field for which a similar name is suggested

/// Returns a path as it is, unless its last name is one that no person would type.
std::string shown(const std::string& path) {
  const std::string marked = in_quotes(path), plain = marked.substr(1, marked.size() - 2);
  return plain == path ? path : marked;
}

class Checker {
 public:
  explicit Checker(const std::string& file) : file_(file) {}

  void object(const Json& json, const flatbuffers::StructDef& table, const std::string& path) const {
    for (const Json& member : json.items) {
      const auto* field = table.fields.Lookup(member.key);
      const std::string member_path = path.empty() ? member.key : path + "." + member.key;
      if (!field) unknown(member, table, member_path);
      value(member, field->value.type, member_path);
    }
  }

 private:
  [[noreturn]] void fail(const Json& json, const std::string& what, const std::string& expected) const {
    throw InputError(file_ + ":" + std::to_string(json.line), what, expected);
  }

  [[noreturn]] void unknown(const Json& json, const flatbuffers::StructDef& table, const std::string& path) const {
    std::string nearest, all;
    const std::string key = json.key.substr(0, kLongestField);
    std::size_t fewest = std::max<std::size_t>(2, key.size() / 3) + 1;
    for (const auto* field : table.fields.vec) {
      all += (all.empty() ? "" : ", ") + field->name;
      if (const auto n = edits(key, field->name); n < fewest) {
        fewest = n;
        nearest = field->name;
      }
    }
    fail(json, shown(path) + " is not a known field", nearest.empty() ? "one of " + all : "\"" + nearest + "\"?");
  }

  void value(const Json& json, const flatbuffers::Type& type, const std::string& path) const {
    using Kind = Json::Kind;
    if (type.base_type == flatbuffers::BASE_TYPE_STRUCT) {
      require(json, Kind::object, path);
      object(json, *type.struct_def, path);
    } else if (type.base_type == flatbuffers::BASE_TYPE_VECTOR) {
      require(json, Kind::array, path);
      for (std::size_t i = 0; i < json.items.size(); ++i) {
        value(json.items[i], type.VectorType(), path + "[" + std::to_string(i) + "]");
      }
    } else if (type.base_type == flatbuffers::BASE_TYPE_STRING) {
      require(json, Kind::string, path);
    } else if (type.base_type == flatbuffers::BASE_TYPE_BOOL) {
      require(json, Kind::boolean, path);
    } else {
      require(json, Kind::number, path);
      number(json, flatbuffers::IsInteger(type.base_type), path);
    }
  }

  void require(const Json& json, Json::Kind kind, const std::string& path) const {
    if (json.kind != kind) fail(json, path + " is " + describe(json.kind), describe(kind));
  }

  void number(const Json& json, bool integer, const std::string& path) const {
    const double v = std::strtod(json.text.c_str(), nullptr);
    if (!std::isfinite(v)) fail(json, path + " is " + shown(json.text), "a finite number");
    if (!integer) return;
    const bool fits = std::abs(v) <= std::numeric_limits<int>::max();
    if (!fits || json.text.find_first_of(".eE") != std::string::npos)
      fail(json, path + " is " + shown(json.text), "a whole number");
  }

  const std::string& file_;
};

}  // namespace

void check_against_schema(const Json& root, const flatbuffers::Parser& parser, const std::string& file) {
  if (root.kind != Json::Kind::object) {
    throw InputError(file + ":" + std::to_string(root.line), std::string("the scene is ") + describe(root.kind), "an object");
  }
  Checker(file).object(root, *parser.root_struct_def_, "");
}

}  // namespace palpate
