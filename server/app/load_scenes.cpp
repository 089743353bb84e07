#include "server/app/load_scenes.hpp"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

#include "common/base/error.hpp"
#include "server/app/describe.hpp"
#include "server/body/unload.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

std::pair<std::string, std::string> split_name(const std::string& given) {
  const std::size_t equals = given.find('=');
  if (equals == std::string::npos || std::filesystem::exists(given)) return {"", given};
  return {given.substr(0, equals), given.substr(equals + 1)};
}

std::vector<NamedScene> load_scenes(const ServerFlags& o) {
  std::vector<NamedScene> scenes;
  for (const std::string& given : o.scenes) {
    auto [name, file] = split_name(given);
    Scene scene = open_scene(file, o.mesh_folders);
    if (name.empty()) name = scene.name;
    if (name.empty() && o.scenes.size() > 1) throw InputError("--scene " + given, "the room has no name", "NAME=FILE");
    check_room_name("--scene " + given, name, scenes);
    scenes.push_back({name, std::move(scene)});
    if (!o.has_record) continue;
    scenes.back().file = std::filesystem::absolute(file).lexically_normal().string();
    scenes.back().text = print_scene(file, o.mesh_folders);
  }
  return scenes;
}

void describe_scenes(const ServerFlags& o) {
  for (const NamedScene& room : load_scenes(o)) {
    fmt::print("scene      \"{}\"\n", room.name);
    for (const std::string& line : describe(room.scene, o.rate_hz).lines) fmt::print("{}\n", line);
  }
}

}  // namespace palpate
