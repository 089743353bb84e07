#include "server/scene/scene_text.hpp"

#include <flatbuffers/idl.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/base/error.hpp"
#include "scene_fbs.hpp"
#include "server/scene/schema_check.hpp"

namespace palpate {

namespace {

std::string read_text(const std::filesystem::path& file) {
  std::error_code ignored;
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file, ignored))
    throw InputError(file.string(), "cannot be read", "a scene file (JSON)");
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

/// What only the parser finds, such as broken UTF-8. Its errors read "FILE:LINE: COLUMN: error: TEXT".
[[noreturn]] void throw_parser_error(const std::string& file, const std::string& error) {
  const auto line_end = error.find(':', std::min(error.size(), file.size() + 1));
  const auto text = error.find("error: ");
  if (error.compare(0, file.size(), file) != 0 || text == std::string::npos || line_end > text) {
    throw InputError(file, error, "a scene as in schema/scene.fbs");
  }
  throw InputError(error.substr(0, line_end), error.substr(text + 7), "a scene as in schema/scene.fbs");
}

flatbuffers::IDLOptions strict() {
  flatbuffers::IDLOptions options;
  options.strict_json = true;
  return options;
}

}  // namespace

SceneText::SceneText(const std::filesystem::path& file) : SceneText(read_text(file), file) {}

SceneText::SceneText(const std::string& text, const std::filesystem::path& file) : file_(file) {
  root_ = parse_json(text, file.string());
  flatbuffers::Parser parser(strict());
  if (!parser.Parse(schema::kSceneFbs)) throw std::logic_error("schema/scene.fbs: " + parser.error_);
  check_against_schema(root_, parser, file.string());
  if (!parser.ParseJson(text.c_str(), file.string().c_str())) {
    throw_parser_error(file.string(), parser.error_);
  }
  flatbuffers::GetRoot<schema::Scene>(parser.builder_.GetBufferPointer())->UnPackTo(&values_);
}

const Json* SceneText::find(const std::string& path, const Json** innermost) const {
  const Json* at = &root_;
  std::size_t i = 0;
  while (at && i < path.size()) {
    if (innermost) *innermost = at;
    const auto end = std::min(path.find_first_of(".[", i), path.size());
    if (path[i] == '[') {
      const auto index = static_cast<std::size_t>(std::stoul(path.substr(i + 1)));
      at = at->kind == Json::Kind::array && index < at->items.size() ? &at->items[index] : nullptr;
      i = path.find(']', i) + 1;
    } else {
      at = at->find(std::string_view(path).substr(i, end - i));
      i = end;
    }
    if (i < path.size() && path[i] == '.') ++i;
  }
  if (at && innermost) *innermost = at;
  return at;
}

bool SceneText::has(const std::string& path) const { return find(path) != nullptr; }

std::string SceneText::where(const std::string& path) const {
  const Json* innermost = &root_;
  find(path, &innermost);
  return file_.string() + ":" + std::to_string(innermost->line);
}

void SceneText::refuse(const std::string& path, const std::string& expected) const {
  const Json* json = find(path);
  if (!json) refuse(path, path + " is missing", expected);
  const bool list = json->kind == Json::Kind::array || json->kind == Json::Kind::object;
  std::string value = list ? write_json(*json) : json->kind == Json::Kind::string ? "\"" + json->text + "\"" : json->text;
  if (list) value.pop_back();
  if (json->kind == Json::Kind::string) {
    if (value.size() > 60) value = value.substr(0, 60) + "...\"";
    for (char& c : value)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  if (list && (value.size() > 60 || value.find('\n') != std::string::npos))
    value = std::to_string(json->items.size()) + " values";
  refuse(path, path + " is " + value, expected);
}

void SceneText::refuse(const std::string& path, const std::string& what, const std::string& expected) const {
  throw InputError(where(path), what, expected);
}

void SceneText::in_range(const std::string& path, double value, double low, double high, const char* unit) const {
  if (value >= low && value <= high) return;
  const std::string range = Json::number(low).text + " to " + Json::number(high).text;
  refuse(path, *unit ? range + " " + unit : range);
}

}  // namespace palpate
