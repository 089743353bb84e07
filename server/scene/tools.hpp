// Tools that a scene may name: the files of scenes/tools, built into the programs.
#pragma once

#include <string>
#include <vector>

#include "common/base/tool_shape.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct NamedTool {
  std::string name, what;
  ToolShape shape;
};

/// All named tools, sorted by name.
const std::vector<NamedTool>& named_tools();

/// Returns the nearest length that a tool may have: whole steps (tool_shape.hpp).
double in_tool_steps(double metres);

/// Returns the body of a tool as it is drawn: spheres along the shaft of a needle or a blade, along its edge, or along the two
/// blades of scissors, which are jaws then; the contacts are not theirs.
ToolShape drawn_shape(const ToolSpec& tool);

/// Returns the number of the scene's tool of that name (Scene::tool_named()). Throws InputError, with `where` and the names that
/// there are, if it has none.
std::uint8_t tool_number(const Scene& scene, const std::string& name, const std::string& where);

/// Returns the tool of that name, or nullptr.
const NamedTool* find_tool(const std::string& name);

/// Lists each named tool in a line.
std::string list_of_tools();

}  // namespace palpate
