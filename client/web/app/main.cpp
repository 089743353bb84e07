// palpate-web: a page for browsers that shows the body that a server simulates or a recording holds, and who touches it.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client/io/end_signals.hpp"
#include "client/web/app/live_page.hpp"
#include "client/web/app/replay_page.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"
#include "common/command_line/flags.hpp"
#include "common/command_line/viewer_session.hpp"
#include "common/file/read_file.hpp"
#include "common/io/endpoint.hpp"
#include "common/io/key_files.hpp"
#include "common/io/monotonic.hpp"
#include "index_html.hpp"
#include "login_html.hpp"
#include "page_css.hpp"
#include "page_js.hpp"

namespace palpate {
namespace {

constexpr std::size_t kPasswordBytesLeast = 8, kPasswordBytesMost = 256;
constexpr Micros kPumpEvery{10'000};  ///< datagrams wait this long at most
constexpr double kLongestS = 1e6;
constexpr const char* kStylePath = "/page.css";  ///< of the page and of the sign-in
constexpr std::size_t kPageBytesMost = 16u << 20, kPageFilesMost = 100;

struct Options {
  std::string server, recording, station = "page", room, key, token, password, page;
  std::string listen = "127.0.0.1:8080";
  std::uint16_t kbit_s = 0;
  std::optional<double> duration_s;
};

/// Returns the first line of the file.
std::string read_password(const std::string& file) {
  std::string text = read_secret_text(file);
  text.erase(std::min(text.find_first_of("\r\n"), text.size()));
  if (text.size() < kPasswordBytesLeast || text.size() > kPasswordBytesMost)
    throw InputError("--password " + file, fmt::format("the first line has {} bytes", text.size()),
                     fmt::format("a password of {} to {} bytes", kPasswordBytesLeast, kPasswordBytesMost));
  return text;
}

void check_name(const char* flag, const std::string& name, std::size_t least) {
  if (name.size() < least || name.size() > static_cast<std::size_t>(kMaxNameBytes) || !is_plain_name(name))
    throw InputError(flag, fmt::format("has {} bytes", name.size()),
                     fmt::format("{} to {} bytes of {}", least, kMaxNameBytes, kNameCharacters));
}

void check(const CLI::App& app, const Options& options) {
  const bool played = app.count("--recording") > 0;
  if (app.count("--server") + app.count("--recording") != 1)
    throw InputError("--server and --recording", played ? "are both given" : "are both missing",
                     "a server to watch or a recording to play");
  for (const char* flag : {"--key", "--token", "--station", "--room", "--kbit-s"})
    if (played && app.count(flag) > 0) throw InputError(flag, "together with --recording", "--server with it");
  for (const char* flag : {"--recording", "--key", "--token", "--password", "--page"})
    if (app.count(flag) > 0 && app.get_option(flag)->as<std::string>().empty()) throw InputError(flag, "is empty", "a file");
  if (!options.token.empty() && options.key.empty())
    throw InputError("--token", "without --key", "the key that it was issued for");
  check_name("--station", options.station, 1);
  check_name("--room", options.room, 0);
}

void add_flags(CLI::App& app, Options& options) {
  app.add_option("--server", options.server, "address at which palpate-server listens")->type_name("HOST:PORT");
  app.add_option("--recording", options.recording, "show this recording of palpate-server instead of a server")
      ->type_name("FILE");
  app.add_option("--listen", options.listen,
                 "address for browsers; one that others can reach needs --password; port 0: a free one")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option("--password", options.password,
                 "file that only its owner can read; browsers have to give its first line, 8 to 256 bytes")
      ->type_name("FILE");
  add_viewer_session(app, options);
  app.add_option("--page", options.page,
                 "folder with index.html and what it needs: a page of your own in place of the built-in one")
      ->type_name("DIR");
  app.add_option("--duration-s", options.duration_s, "end after this many seconds; default: when asked to")
      ->check(number_from(0.0, kLongestS));
}

std::unique_ptr<Page> open_page(const CLI::App& app, const Options& options) {
  if (options.recording.empty()) {
    std::optional<ClientKeys> keys;
    if (!options.key.empty()) keys = read_client_keys(options.key, options.token);
    return std::make_unique<LivePage>(
        LiveSession{options.server, options.station, app.count("--station") == 0, std::move(keys), options.kbit_s}, options.room);
  }
  auto page = std::make_unique<ReplayPage>(options.recording);
  if (const std::string damage = page->damage(); !damage.empty())
    fmt::print(stderr, "palpate-web: {}: {}\n", options.recording, damage);
  return page;
}

/// A file of somebody's own page, read once.
struct OwnFile {
  std::string path, type, text;
};

/// Returns the files of a folder, without its subfolders. Throws InputError for one without index.html, and for a file that is no
/// part of a page.
std::deque<OwnFile> read_page(const std::string& folder) {
  static const std::map<std::string, std::string> kTypes{{".html", "text/html; charset=utf-8"},
                                                         {".js", "text/javascript; charset=utf-8"},
                                                         {".css", "text/css; charset=utf-8"},
                                                         {".json", "application/json"},
                                                         {".svg", "image/svg+xml"},
                                                         {".png", "image/png"}};
  const std::string where = "--page " + folder;
  std::error_code fault;
  std::deque<OwnFile> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, fault)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || entry.is_directory()) continue;
    const auto type = kTypes.find(entry.path().extension().string());
    if (type == kTypes.end() || files.size() == kPageFilesMost)
      throw InputError(where, name + " is there",
                       fmt::format("at most {} files, of html, js, css, json, svg and png", kPageFilesMost));
    files.push_back({name == "index.html" ? "/" : "/" + name, type->second,
                     read_plain_file(entry.path(), where, "a file of a page", kPageBytesMost)});
  }
  const auto is_first = [](const OwnFile& file) { return file.path == "/"; };
  if (fault || std::none_of(files.begin(), files.end(), is_first))
    throw InputError(where, fault ? fault.message() : "has no index.html", "a folder with index.html");
  return files;
}

/// The built-in page, or somebody's own one with the built-in sign-in.
std::vector<WebFile> files_of(const std::deque<OwnFile>& own) {
  std::vector<WebFile> files;
  for (const OwnFile& file : own) files.push_back({file.path, file.type, file.text, file.path == kStylePath});
  const auto add = [&](const WebFile& file) {
    if (std::none_of(files.begin(), files.end(), [&](const WebFile& other) { return other.path == file.path; }))
      files.push_back(file);
  };
  add({"/", "text/html; charset=utf-8", kPageIndex});
  add({"/login", "text/html; charset=utf-8", kPageLogin, true});
  add({kStylePath, "text/css; charset=utf-8", kPageStyle, true});
  if (own.empty()) add({"/page.js", "text/javascript; charset=utf-8", kPageScript});
  return files;
}

void serve(const CLI::App& app, const Options& options, const std::atomic<bool>& stop) {
  const std::string password = options.password.empty() ? "" : read_password(options.password);
  const std::unique_ptr<Page> page = open_page(app, options);
  const UdpEndpoint listen = resolve_udp("--listen", options.listen);
  const std::deque<OwnFile> own = options.page.empty() ? std::deque<OwnFile>() : read_page(options.page);
  WebServer web({listen.address().to_string(), listen.port(), password}, files_of(own), *page);
  fmt::print("palpate-web {}: http://{}/{}\n", PALPATE_VERSION, web.address(),
             listen.address().is_unspecified() ? ", and at every other address of this machine" : "");
  std::fflush(stdout);
  const Micros begun = monotonic_now();
  const Micros end = options.duration_s ? begun + from_seconds(*options.duration_s) : Micros::max();
  for (Micros now = begun; now < end && !stop; now = monotonic_now()) {
    const Micros next = page->tick(web, now);
    web.run_for(std::clamp(next - now, Micros{1'000}, kPumpEvery));
  }
}

int run(int argc, char** argv) {
  static std::atomic<bool> stop{false};
  Options options;
  CLI::App app("a page for browsers with the body that a server simulates or a recording holds, and who touches it",
               "palpate-web");
  describe_program(app, PALPATE_VERSION, "palpate-web --server 127.0.0.1:47800");
  add_flags(app, options);
  return run_program(app, [&] {
    app.parse(argc, argv);
    check(app, options);
    end_by_signals(stop);
    serve(app, options, stop);
    return 0;
  });
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) { return palpate::run(argc, argv); }
