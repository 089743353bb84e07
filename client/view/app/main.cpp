// palpate-view: shows the body that a server simulates or a recording holds, and the tools that touch it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>

#include "client/view/app/offscreen.hpp"
#include "client/view/app/window.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {
namespace {

constexpr int kSmallest = 64, kLargest = 8192;
constexpr double kLongestS = 1e6;

void read_size(const std::string& text, ViewOptions& options) {
  char rest = 0;
  const int fields = std::sscanf(text.c_str(), "%5dx%5d%c", &options.width, &options.height, &rest);
  const auto fits = [](int n) { return n >= kSmallest && n <= kLargest; };
  if (fields != 2 || !fits(options.width) || !fits(options.height)) {
    throw InputError("--size " + text, "not a size", fmt::format("WIDTHxHEIGHT, each from {} to {}", kSmallest, kLargest));
  }
}

/// Flags that mean something only with a server, or only with a recording.
void check_source(const CLI::App& app, const ViewOptions& options) {
  if (app.count("--server") + app.count("--recording") != 1)
    throw InputError("--server and --recording", app.count("--server") > 0 ? "are both given" : "are both missing",
                     "a server to watch or a recording to play");
  const bool played = app.count("--recording") > 0;
  if (played && options.recording.empty()) throw InputError("--recording", "is empty", "a file");
  for (const char* flag : {"--station", "--room", "--touch", "--after-s", "--kbit-s", "--record"})
    if (played && app.count(flag) > 0) throw InputError(flag, "together with --recording", "--server with it");
  if (!played && app.count("--at") > 0) throw InputError("--at", "together with --server", "--recording with it");
}

/// Where pictures go, before anybody waits for them.
void check_outputs(const ViewOptions& options) {
  std::error_code error;
  if (!options.frames.empty() &&
      (std::filesystem::create_directories(options.frames, error), !std::filesystem::is_directory(options.frames, error)))
    throw InputError("--frames " + options.frames, "cannot be made", "a folder that can be written to");
  if (options.screenshot.empty()) return;
  const auto folder = std::filesystem::path(options.screenshot).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw InputError("--screenshot " + options.screenshot, "has no such folder", "a file in a folder that is there");
}

/// What the flags' own ranges let through: "nan" lies in every range, and an unset shell variable is an empty text.
void check(const CLI::App& app, const ViewOptions& options) {
  for (const auto& [flag, value] : {std::pair{"--after-s", options.after_s.value_or(0)},
                                    {"--duration-s", options.duration_s.value_or(0)},
                                    {"--at", options.at_s},
                                    {"--fps", options.fps}})
    if (std::isnan(value)) throw InputError(flag, "is nan", "a number");
  for (const auto& [flag, value] :
       {std::pair{"--screenshot", &options.screenshot}, {"--frames", &options.frames}, {"--record", &options.record}})
    if (app.count(flag) > 0 && value->empty()) throw InputError(flag, "is empty", "a path");
  const auto printable = [](unsigned char c) { return c >= 0x20 && c != 0x7f; };
  const std::string& name = options.station;
  const bool fits = !name.empty() && name.size() <= static_cast<std::size_t>(kMaxNameBytes);
  if (!fits || !std::all_of(name.begin(), name.end(), printable))
    throw InputError("--station", fmt::format("has {} bytes", name.size()),
                     fmt::format("1 to {} bytes without control characters", kMaxNameBytes));
  if (options.room.size() > static_cast<std::size_t>(kMaxNameBytes) ||
      !std::all_of(options.room.begin(), options.room.end(), printable))
    throw InputError("--room", fmt::format("has {} bytes", options.room.size()),
                     fmt::format("up to {} bytes without control characters", kMaxNameBytes));
  if (!options.touch.empty() && options.offscreen())
    throw InputError("--touch", "together with --screenshot or --frames", "a window: there is no mouse without one");
  if (options.look.patch && options.touch.empty())
    throw InputError("--patch", "without --touch", "a hand of this viewer's own, whose patches it has");
}

void add_flags(CLI::App& app, ViewOptions& options, std::string& size, bool& light) {
  app.set_version_flag("--version", "palpate-view " PALPATE_VERSION);
  app.add_option("--server", options.server, "HOST:PORT of palpate-server");
  app.add_option("--recording", options.recording, "play this recording of palpate-server in place of a server")
      ->type_name("FILE");
  app.add_option("--at", options.at_s, "moment of the recording to begin at, in seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, kLongestS));
  app.add_option("--station", options.station, "name of this viewer in the room")->capture_default_str();
  app.add_option("--room", options.room, "name of the room on the server; default: its first")->type_name("NAME");
  app.add_flag("--touch{mouse}", options.touch, "the mouse touches the body, as a station; --touch=NAME names it");
  app.add_flag("--patch", options.look.patch, "with --touch: show what its patches said of the server's next frame");
  app.add_option("--record", options.record, "record what is received, to a new FILE")->type_name("FILE");
  app.add_option("--size", size, "WIDTHxHEIGHT of window or picture, default 1280x800");
  app.add_option("--screenshot", options.screenshot, "write one picture to FILE.png, without a display, and end");
  app.add_option("--after-s", options.after_s, "take the first picture after so many seconds")->check(CLI::Range(0.0, kLongestS));
  app.add_option("--frames", options.frames,
                 "write pictures DIR/frame_NNNNN.png, without a display, for --duration-s (default 10)");
  app.add_option("--fps", options.fps, "pictures a second with --frames")->capture_default_str()->check(CLI::Range(0.01, 60.0));
  app.add_option("--duration-s", options.duration_s, "end after so many seconds")->check(CLI::Range(0.0, kLongestS));
  app.add_option("--color", options.look.color, "what colours show: displacement, tension or support")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ShapeChannel>{
          {"displacement", ShapeChannel::position}, {"tension", ShapeChannel::tension}, {"support", ShapeChannel::support}}));
  app.add_option("--lines", options.look.lines, "over the body: none, edges or strain")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Lines>{{"none", Lines::none}, {"edges", Lines::edges}, {"strain", Lines::strain}}));
  app.add_flag("--panels,!--no-panels", options.look.panels, "stations, plots and body beside the picture (default on)");
  app.add_option("--kbit-s", options.kbit_s, "most that shapes may take; 0: what the server thinks right")
      ->check(CLI::Range(0, 65535));
  auto* dark = app.add_flag("--dark", options.look.dark, "light things on a dark ground");
  app.add_flag("--light", light, "dark things on a light ground (default)")->excludes(dark);
}

void watch(const ViewOptions& options) {
  ViewSession session(options.server, options.station, options.room);
  session.show_channel(options.look.color);
  session.core().limit(options.kbit_s);
  if (!options.record.empty()) session.record(options.record);
  options.offscreen() ? run_offscreen(options, session) : run_window(options, session);
}

void play(const ViewOptions& options) {
  RecordedSource recording(options.recording);
  const std::string damage = recording.damage();
  if (!damage.empty()) fmt::print(stderr, "palpate-view: {}: {}\n", options.recording, damage);
  recording.show_channel(options.look.color);
  recording.begin_at(options.at_s);
  options.offscreen() ? run_offscreen(options, recording) : run_window(options, recording);
}

int run(int argc, char** argv) {
  ViewOptions options;
  std::string size;
  bool light = false;
  CLI::App app("Shows the body that a server simulates, and the tools that touch it.", "palpate-view");
  add_flags(app, options, size, light);
  try {
    app.parse(argc, argv);
    if (app.count("--size") > 0) read_size(size, options);
    check_source(app, options);
    check(app, options);
    check_outputs(options);
    watch_signals();
    options.recording.empty() ? watch(options) : play(options);
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "palpate-view: {}\n", error.what());
    return 2;
  } catch (const InputError& error) {
    fmt::print(stderr, "palpate-view: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "palpate-view: {}\n", error.what());
    return 1;
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) { return palpate::run(argc, argv); }
