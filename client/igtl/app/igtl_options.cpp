#include "client/igtl/app/igtl_options.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"
#include "common/command_line/viewer_session.hpp"
#include "common/io/make_folder.hpp"
#include "material_names.hpp"

namespace palpate {

namespace {

constexpr double kLongestS = 1e6;
constexpr const char* kOfSending[] = {"--key", "--token", "--station", "--room", "--kbit-s", "--rate-hz"};
constexpr const char* kOfReceiving[] = {"--material", "--spacing-mm", "--hold-mm", "--radius-mm"};

void check_word(const char* flag, const std::string& name, std::size_t least) {
  if (name.size() < least || name.size() > static_cast<std::size_t>(kMaxNameBytes) || !is_plain_name(name))
    throw InputError(flag, fmt::format("has {} bytes", name.size()),
                     fmt::format("{} to {} bytes of {}", least, kMaxNameBytes, kNameCharacters));
}

void check_material(const std::string& name) {
  if (std::ranges::find(kMaterialNames, name) != std::end(kMaterialNames)) return;
  std::string known;
  for (const std::string_view material : kMaterialNames) known += (known.empty() ? "" : ", ") + std::string(material);
  throw InputError("--material", name.empty() ? "is missing" : "\"" + name + "\" is unknown", "one of " + known);
}

/// Makes the folder of the scene where it is missing. Throws InputError for a place at which no file can be written.
void check_place(const std::string& receive) {
  const std::filesystem::path scene = receive;
  const std::string where = "--receive " + receive;
  if (!scene.has_filename() || std::filesystem::is_directory(scene))
    throw InputError(where, "is a folder", "a scene file to write");
  make_folder(where, scene.parent_path());
  const std::filesystem::path folder = scene.has_parent_path() ? scene.parent_path() : ".";
  if (access(folder.c_str(), W_OK) != 0)
    throw InputError(where, "folder " + folder.string() + " cannot be written to", "a folder that can be written to");
}

}  // namespace

void add_igtl_flags(CLI::App& app, IgtlOptions& options) {
  app.add_option("--server", options.server, "send what this palpate-server simulates")->type_name("HOST:PORT");
  app.add_option("--receive", options.receive, "wait for a surface, write it and this scene, and end")->type_name("SCENE");
  app.add_option("--listen", options.listen, "address for 3D Slicer and others; port 0: a free one")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_flag("--insecure", options.insecure, "allow --listen at an address that other machines can reach");
  app.add_option("--up", options.up, "direction of the patient that is up in the scene: " + std::string(kPatientUps))
      ->type_name("DIRECTION")
      ->capture_default_str();
  app.add_option("--rate-hz", options.rate_hz, "moments a second")->capture_default_str()->check(number_from(1.0, 60.0));
  add_viewer_session(app, options);
  app.add_option("--material", options.material, "received body: a name of palpate-server --list-materials")->type_name("NAME");
  app.add_option("--spacing-mm", options.spacing_mm, "received body: distance of its nodes")
      ->capture_default_str()
      ->check(number_from(0.5, 100.0));
  app.add_option("--hold-mm", options.hold_mm,
                 "received body: height from its lowest point up to which it is held; default: 15 %")
      ->check(number_from(0.1, 1000.0));
  app.add_option("--radius-mm", options.radius_mm, "received body: contact radius of the tip; default: twice the spacing")
      ->check(number_from(0.1, 200.0));
  app.add_option("--duration-s", options.duration_s, "end after this many seconds; default: when asked to")
      ->check(number_from(0.0, kLongestS));
}

void check_igtl(const CLI::App& app, const IgtlOptions& options) {
  const bool receives = app.count("--receive") > 0;
  if (app.count("--server") + app.count("--receive") != 1)
    throw InputError("--server and --receive", receives ? "are both given" : "are both missing",
                     "a server to show or a scene to write");
  if (receives) {
    for (const char* flag : kOfSending)
      if (app.count(flag) > 0) throw InputError(flag, "together with --receive", "--server with it");
    if (options.receive.empty()) throw InputError("--receive", "is empty", "a scene file to write");
    check_material(options.material);
    check_place(options.receive);
  } else {
    for (const char* flag : kOfReceiving)
      if (app.count(flag) > 0) throw InputError(flag, "together with --server", "--receive with it");
  }
  for (const char* flag : {"--key", "--token"})
    if (app.count(flag) > 0 && app.get_option(flag)->as<std::string>().empty()) throw InputError(flag, "is empty", "a file");
  if (!options.token.empty() && options.key.empty())
    throw InputError("--token", "without --key", "the key that it was issued for");
  check_word("--station", options.station, 1);
  check_word("--room", options.room, 0);
  patient_up(options.up);
}

}  // namespace palpate
