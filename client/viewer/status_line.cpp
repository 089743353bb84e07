#include "client/viewer/status_line.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>

#include "common/base/counted.hpp"

namespace palpate {

namespace {

/// "    OR 3 guides OR 1" for each hold.
std::string holds_text(const ViewCore& core) {
  std::string text;
  if (core.playback().tools().empty()) return text;
  for (const ToolView& tool : core.playback().tools().back().tools)
    if (!tool.guides.empty()) text += fmt::format("    {} guides {}", tool.station, tool.guides);
  return text;
}

}  // namespace

std::string status_line(const ViewCore& core, Micros now) {
  if (core.link() != LinkState::joined) return "the server was lost; its last shape is shown";
  if (!core.heard_lately(now))
    return fmt::format("the server has been silent for {:.1f} s; its last shape is shown", seconds(core.silence(now)));
  const int shapes = core.shapes_lately(now);
  const std::string body = fmt::format("{} triangles", core.mesh().triangles.size());
  if (shapes == 0 || core.room().asleep) return body + "    still" + holds_text(core);
  const char* const starved = core.room().starved ? "    the server's machine is starved" : "";
  return fmt::format("{}    {} in the last second, shown {:.0f} ms late{}{}", body,
                     counted(static_cast<std::uint64_t>(shapes), "shape"), 1e3 * seconds(core.lateness(now)), starved,
                     holds_text(core));
}

std::string status_line(const RecordingHead& head, std::size_t triangles) {
  const std::chrono::sys_seconds made{std::chrono::duration_cast<std::chrono::seconds>(head.unix_time)};
  return fmt::format("recorded {:%Y-%m-%d %H:%M} UTC    {:.3g} shapes a second    {} triangles", made, head.shapes_hz, triangles);
}

}  // namespace palpate
