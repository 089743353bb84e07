// The flag that says which tools of a scene with several the hands hold.
#pragma once

#include <string>
#include <vector>

#include "common/command_line/flags.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// `of`: begin of the help.
inline void add_tools_held(CLI::App& app, std::vector<std::string>& tools, const std::string& of = "") {
  app.add_option("--tools", tools, of + "name of the tool that each hand holds, of a scene with several, separated by commas")
      ->type_name("NAME,...")
      ->delimiter(',');
}

/// Returns the number of the tool of each of `hands` hands, empty where no names are given. Throws InputError for names of no
/// tool of the scene, and for another number of names; `counted`: the flag that gave the number of hands.
std::vector<std::uint8_t> tools_held(const Scene& scene, const std::vector<std::string>& names, std::size_t hands,
                                     const std::string& counted);

}  // namespace palpate
