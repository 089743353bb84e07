#include "server/scene/scene_text.hpp"

#include <flatbuffers/idl.h>

#include <stdexcept>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/file/read_file.hpp"
#include "scene_fbs.hpp"
#include "server/scene/schema_check.hpp"

namespace palpate {

namespace {

constexpr std::size_t kLongestNumber = 60;        // longest number quoted in a message
constexpr std::size_t kMaxSceneBytes = 4u << 20;  // memory is about fifty times that

/// Returns true if a file lies below a folder, with links resolved.
bool lies_below(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code fault;
  const auto place = std::filesystem::weakly_canonical(std::filesystem::absolute(file), fault);  // the file need not exist
  if (fault) return false;
  const auto root = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, fault);
  const auto inside = place.lexically_relative(root);
  return !fault && !inside.empty() && *inside.begin() != "..";
}

MeshFolders with(const std::filesystem::path& folder, const MeshFolders& besides) {
  MeshFolders all{folder};
  all.insert(all.end(), besides.begin(), besides.end());
  return all;
}

/// Reports faults that only the parser finds, such as broken UTF-8. Its errors read "FILE:LINE: COLUMN: error: TEXT".
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

SceneText::SceneText(const std::filesystem::path& file, const MeshFolders& besides)
    : SceneText(without_mark(read_file(file, file.string(), "a scene file (JSON)", kMaxSceneBytes)), file,
                with(file.parent_path(), besides)) {}

SceneText::SceneText(const std::string& text, const std::filesystem::path& file, MeshFolders folders)
    : file_(file), folders_(std::move(folders)) {
  if (text.size() > kMaxSceneBytes)
    throw InputError(file.string(), "is too long", "at most " + std::to_string(kMaxSceneBytes) + " bytes");
  root_ = std::make_shared<const Json>(parse_json(text, file.string()));
  flatbuffers::Parser parser(strict());
  if (!parser.Parse(schema::kSceneFbs)) throw std::logic_error("schema/scene.fbs: " + parser.error_);
  check_against_schema(*root_, parser, file.string());
  if (!parser.ParseJson(text.c_str(), file.string().c_str())) {
    throw_parser_error(file.string(), parser.error_);
  }
  values_ =
      std::shared_ptr<const schema::SceneT>(flatbuffers::GetRoot<schema::Scene>(parser.builder_.GetBufferPointer())->UnPack());
}

SceneText SceneText::of_member(std::size_t i) const {
  SceneText one = *this;
  one.body_ = "bodies[" + std::to_string(i) + "]";
  return one;
}

std::string SceneText::named(const std::string& path) const {
  constexpr std::string_view kBody = "body";
  const bool is_of_body =
      path.starts_with(kBody) && (path.size() == kBody.size() || path[kBody.size()] == '.' || path[kBody.size()] == ' ');
  return is_of_body ? body_ + path.substr(kBody.size()) : path;
}

const Json* SceneText::find(const std::string& in_scene, const Json** innermost) const {
  const std::string path = named(in_scene);
  const Json* at = root_.get();
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
  const Json* innermost = root_.get();
  find(path, &innermost);
  return file_.string() + ":" + std::to_string(innermost->line);
}

std::filesystem::path SceneText::mesh_path(const std::string& path, const std::string& named) const {
  if (!is_plain_text(named)) refuse(path, "a name without control characters");
  const auto file = file_.parent_path() / named;
  for (const auto& folder : folders_)
    if (lies_below(file, folder)) return file;
  std::error_code ignored;
  const auto folder = std::filesystem::weakly_canonical(std::filesystem::absolute(file), ignored).parent_path();
  refuse(path,
         path + " is " + in_quotes(named) + ", which lies outside of " + (folders_.empty() ? "every" : "the scene's") +
             " folder for meshes",
         "a mesh below it, or --mesh-folder " + in_quotes(folder.string()));
}

void SceneText::refuse(const std::string& path, const std::string& expected) const {
  const Json* json = find(path);
  if (!json) refuse(path, path + " is missing", expected);
  const bool list = json->kind == Json::Kind::array || json->kind == Json::Kind::object;
  std::string value = list                               ? write_json(*json)
                      : json->kind == Json::Kind::string ? in_quotes(json->text)
                                                         : json->text.substr(0, kLongestNumber);
  if (list) value.pop_back();
  if (list && (value.size() > 60 || value.find('\n') != std::string::npos))
    value = std::to_string(json->items.size()) + " values";
  refuse(path, path + " is " + value, expected);
}

void SceneText::refuse(const std::string& path, const std::string& what, const std::string& expected) const {
  throw InputError(where(path), named(what), expected);
}

void SceneText::in_range(const std::string& path, double value, double low, double high, const char* unit) const {
  if (value >= low && value <= high) return;
  const std::string range = Json::number(low).text + " to " + Json::number(high).text;
  refuse(path, *unit ? range + " " + unit : range);
}

}  // namespace palpate
