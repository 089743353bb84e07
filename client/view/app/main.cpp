// palpate-view: shows the body that a server simulates or a recording holds, and the tools that touch it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client/view/app/offscreen.hpp"
#include "client/view/app/window.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"
#include "common/command_line/flags.hpp"
#include "common/io/key_files.hpp"
#include "common/io/make_folder.hpp"

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

/// Refuses flags that are meaningful only with a server, or only with a recording.
void check_source(const CLI::App& app, const ViewOptions& options) {
  if (app.count("--server") + app.count("--recording") != 1)
    throw InputError("--server and --recording", app.count("--server") > 0 ? "are both given" : "are both missing",
                     "a server to watch or a recording to play");
  const bool played = app.count("--recording") > 0;
  if (played && options.recording.empty()) throw InputError("--recording", "is empty", "a file");
  for (const char* flag :
       {"--key", "--token", "--station", "--room", "--touch", "--guide", "--tool", "--after-s", "--kbit-s", "--record"})
    if (played && app.count(flag) > 0) throw InputError(flag, "together with --recording", "--server with it");
  if (!played && app.count("--at") > 0) throw InputError("--at", "together with --server", "--recording with it");
}

/// Checks the destinations of pictures before any waiting.
void check_outputs(const ViewOptions& options) {
  if (!options.frames.empty()) make_folder("--frames " + options.frames, options.frames);
  if (!options.screenshot.empty())
    make_folder("--screenshot " + options.screenshot, std::filesystem::path(options.screenshot).parent_path());
}

/// Checks values that pass the flags' own checks, such as the empty text of an unset shell variable.
void check(const CLI::App& app, const ViewOptions& options) {
  for (const auto& [flag, value] : {std::pair{"--key", &options.key},
                                    {"--token", &options.token},
                                    {"--screenshot", &options.screenshot},
                                    {"--frames", &options.frames},
                                    {"--record", &options.record}})
    if (app.count(flag) > 0 && value->empty()) throw InputError(flag, "is empty", "a path");
  const std::string& name = options.station;
  const bool fits = !name.empty() && name.size() <= static_cast<std::size_t>(kMaxNameBytes);
  if (!fits || !is_plain_name(name))
    throw InputError("--station", fmt::format("has {} bytes", name.size()),
                     fmt::format("1 to {} bytes of {}", kMaxNameBytes, kNameCharacters));
  if (options.room.size() > static_cast<std::size_t>(kMaxNameBytes) || !is_plain_name(options.room))
    throw InputError("--room", fmt::format("has {} bytes", options.room.size()),
                     fmt::format("up to {} bytes of {}", kMaxNameBytes, kNameCharacters));
  if (!options.token.empty() && options.key.empty())
    throw InputError("--token", "without --key", "the key that it was issued for");
  if (!options.touch.empty() && options.offscreen())
    throw InputError("--touch", "together with --screenshot or --frames", "a window: there is no mouse without one");
  for (const auto& [flag, given, does] : {std::tuple("--guide", &options.guide, "guides"), {"--tool", &options.tool, "holds it"}})
    if (app.count(flag) > 0 && (options.touch.empty() || given->empty() ||
                                given->size() > static_cast<std::size_t>(kMaxNameBytes) || !is_plain_name(*given)))
      throw InputError(flag, options.touch.empty() ? "without --touch" : "is no name",
                       options.touch.empty() ? fmt::format("the mouse as a station, which {}", does)
                                             : fmt::format("1 to {} bytes of {}", kMaxNameBytes, kNameCharacters));
  if (options.look.patch && options.touch.empty())
    throw InputError("--patch", "without --touch", "a hand of this viewer's own, whose patches it has");
}

/// Adds a flag that accepts one of these words; the first is the default.
template <class Value>
void add_choice(CLI::App& app, const char* flag, Value& value, const std::string& help,
                const std::vector<std::pair<std::string, Value>>& choices) {
  std::string names;
  for (const auto& [name, choice] : choices) names += (names.empty() ? "" : "|") + name;
  const auto choose = [flag, &value, choices, names](const std::string& typed) {
    for (const auto& [name, choice] : choices)
      if (name == typed) {
        value = choice;
        return;
      }
    throw InputError(std::string(flag) + " " + typed, "is unknown", "one of " + names);
  };
  app.add_option_function<std::string>(flag, choose, help)->type_name(names)->default_str(choices.front().first);
}

void add_flags(CLI::App& app, ViewOptions& options, std::string& size, bool& light) {
  app.add_option("--server", options.server, "address at which palpate-server listens")->type_name("HOST:PORT");
  app.add_option(
         "--key", options.key,
         "key file of this station (palpate-key new), for a server with --keys; it contains the key of the trusted server")
      ->type_name("FILE");
  app.add_option("--token", options.token, "token from palpate-key issue, for a server whose key file does not contain this key")
      ->type_name("FILE");
  app.add_option("--recording", options.recording, "play this recording of palpate-server instead of watching a server")
      ->type_name("FILE");
  app.add_option("--at", options.at_s, "time in the recording at which to begin [s]")
      ->capture_default_str()
      ->check(number_from(0.0, kLongestS));
  app.add_option("--station", options.station,
                 "name of this viewer, unique in the room; the server appends a number to the default name if it is taken")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--room", options.room, "name of the room on the server; default: its first")->type_name("NAME");
  app.add_flag(
      "--touch{mouse}", options.touch,
      "the mouse touches the body, as a station; --touch=NAME names it, default: \"mouse\", with a number if that is taken");
  app.add_option("--guide", options.guide,
                 "with --touch: station of this room whose tool the mouse guides (palpate-client --guide)")
      ->type_name("NAME");
  app.add_option("--tool", options.tool, "with --touch: name of the tool that the mouse holds (palpate-client --tool)")
      ->type_name("NAME");
  app.add_flag("--patch", options.look.patch, "with --touch: show how its patches predicted the server's next frame");
  app.add_option("--record", options.record, "record the received data to a new FILE")->type_name("FILE");
  app.add_option("--size", size, "size of the window or picture")->type_name("WIDTHxHEIGHT")->default_str("1280x800");
  app.add_option("--screenshot", options.screenshot, "write one picture, without a display, and end")->type_name("FILE.png");
  app.add_option("--after-s", options.after_s, "take the first picture after this many seconds; default: 2, or 0 with --frames")
      ->check(number_from(0.0, kLongestS));
  app.add_option(
         "--frames", options.frames,
         "write pictures DIR/frame_NNNNN.png, without a display, for --duration-s (default 10; of a recording: all of it)")
      ->type_name("DIR");
  app.add_option("--fps", options.fps, "pictures per second with --frames")
      ->capture_default_str()
      ->check(number_from(0.01, 60.0));
  app.add_option("--duration-s", options.duration_s, "end after this many seconds; default: when the window is closed")
      ->check(number_from(0.0, kLongestS));
  app.add_option_function<float>(
         "--nearer", [&options](float times) { options.camera.come_nearer(times); },
         "how many times nearer than where all of the body is in the picture")
      ->default_str("1")
      ->check(number_from(0.1, 10.0));
  add_choice(
      app, "--color", options.look.color,
      "quantity that colours show: displacement from rest, the largest force in a spring, the support of the local patches, "
      "or of finite elements the von Mises stress, the largest principal strain or the pressure",
      {{"displacement", ShapeChannel::position},
       {"tension", ShapeChannel::tension},
       {"support", ShapeChannel::support},
       {"stress", ShapeChannel::stress},
       {"strain", ShapeChannel::strain},
       {"pressure", ShapeChannel::pressure}});
  add_choice(app, "--lines", options.look.lines,
             "lines on the body: none, the edges of its triangles, or the edges in the colour of their strain",
             {{"none", Lines::none}, {"edges", Lines::edges}, {"strain", Lines::strain}});
  app.add_flag("--panels,!--no-panels", options.look.panels,
               "show stations, plots and figures of the body next to the picture, and the bar of a recording; default: shown");
  app.add_option("--kbit-s", options.kbit_s, "highest data rate of shapes [kbit/s]; 0: the server's default")
      ->capture_default_str()
      ->check(number_from(0, 65535));
  auto* dark = app.add_flag("--dark", options.look.dark, "light foreground on a dark background");
  app.add_flag("--light", light, "dark foreground on a light background (default)")->excludes(dark);
}

void watch(const ViewOptions& options) {
  ViewSession session(options.server, options.station, options.room, !options.station_given, options.keys);
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
  CLI::App app("shows the body that a server simulates, and the tools that touch it", "palpate-view");
  describe_program(app, PALPATE_VERSION, "palpate-view --server 127.0.0.1:47800 --touch");
  add_flags(app, options, size, light);
  return run_program(app, [&] {
    app.parse(argc, argv);
    if (app.count("--size") > 0) read_size(size, options);
    options.station_given = app.count("--station") > 0;
    check_source(app, options);
    check(app, options);
    check_outputs(options);
    if (!options.key.empty()) options.keys = read_client_keys(options.key, options.token);
    watch_signals();
    options.recording.empty() ? watch(options) : play(options);
    return 0;
  });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) { return palpate::run(argc, argv); }
