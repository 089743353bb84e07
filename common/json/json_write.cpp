#include <algorithm>
#include <string_view>

#include "common/json/json.hpp"

namespace palpate {

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      constexpr std::string_view kHex = "0123456789abcdef";
      out += "\\u00";
      out += kHex[static_cast<unsigned char>(c) >> 4];
      out += kHex[static_cast<unsigned char>(c) & 15];
    } else {
      out += c;
    }
  }
  return out + '"';
}

bool plain(const Json& json) { return json.kind != Json::Kind::array && json.kind != Json::Kind::object; }

void write(std::string& out, const Json& json, std::size_t depth) {
  if (plain(json)) {
    out += json.kind == Json::Kind::string ? quoted(json.text) : json.kind == Json::Kind::null ? "null" : json.text;
    return;
  }
  const bool list = json.kind == Json::Kind::array;
  const bool one_line = list && std::all_of(json.items.begin(), json.items.end(), plain);
  out += list ? '[' : '{';
  for (std::size_t i = 0; i < json.items.size(); ++i) {
    if (i > 0) out += one_line ? ", " : ",";
    if (!one_line) out += "\n" + std::string(2 * depth + 2, ' ');
    if (!list) out += quoted(json.items[i].key) + ": ";
    write(out, json.items[i], depth + 1);
  }
  if (!one_line) out += "\n" + std::string(2 * depth, ' ');
  out += list ? ']' : '}';
}

}  // namespace

std::string write_json(const Json& value) {
  std::string out;
  write(out, value, 0);
  return out + "\n";
}

}  // namespace palpate
