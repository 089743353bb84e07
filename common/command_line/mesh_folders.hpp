// The flag of every program that opens scenes: folders for their meshes besides the scene's own folder.
#pragma once

#include <filesystem>
#include <vector>

#include "common/command_line/flags.hpp"

namespace palpate {

inline void add_mesh_folders(CLI::App& app, std::vector<std::filesystem::path>& folders) {
  app.add_option(
         "--mesh-folder", folders,
         "a folder below which scenes may name meshes, besides that of the scene; give it again for each further one. What a "
         "recording holds may name none without it")
      ->type_name("DIR")
      ->allow_extra_args(false);
}

}  // namespace palpate
