// palpate-key: keys of servers, stations and issuers, and the tokens that issuers sign.
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/base/limits.hpp"
#include "common/command_line/flags.hpp"
#include "common/io/key_files.hpp"
#include "common/trust/token.hpp"

namespace {

using namespace palpate;

constexpr int kLongestSession = 30 * 86400;

struct Options {
  std::string file, server, station, name, roles = "hand,viewer", issuer_file;
  std::vector<std::string> rooms;
  bool issuer = false;
  int kbit_s = kKbitUsual, streams = kStreamsUsual, join_within_s = 60, session_s = 7200;
};

PublicKey key_given(const char* where, const std::string& text) {
  const auto key = key_from(text);
  if (!key) throw InputError(where, "\"" + text + "\" is no key", "the 44 characters that palpate-key printed");
  return *key;
}

/// Returns a name that can be part of a line of a key file: it must not contain what would end it there.
const std::string& name_given(const char* where, const std::string& name) {
  if (!fits_name(name)) throw InputError(where, in_quotes(name) + " is no name", kNameExpected);
  return name;
}

/// `where_name`: the argument with the name.
Rights rights_given(const Options& o, const char* where_name) {
  Rights rights;
  name_given(where_name, o.name);
  for (const std::string& room : o.rooms) name_given("--room", room);
  rights.name = o.name;
  rights.rooms = o.rooms;
  rights.kbit_s = o.kbit_s;
  rights.streams = o.streams;
  if (!read_roles(o.roles, rights)) throw InputError("--role", "\"" + o.roles + "\" is no role", kRolesExpected);
  // The limits of key files apply to tokens, too.
  parse_keys(station_line(PublicKey{}, rights), "--room");
  return rights;
}

/// Prints a line; throws when it cannot be written, because the key or token is lost then.
void print_line(const std::string& text) {
  if (std::printf("%s\n", text.c_str()) < 0 || std::fflush(stdout) != 0)
    throw InputError("standard output", "cannot be written", "room on the disk");
}

KeyFile read_key_file(const std::string& file) { return parse_keys(read_secret_text(file), file); }

void make_new(const Options& o) {
  const SecretKey secret = draw_secret(system_random());
  IssuerSecret issuer;
  issuer.bytes = secret.bytes;
  std::string text = (o.issuer ? "issuer-self " : "self ") + to_text(Bytes(secret.bytes)) + "\n";
  if (!o.server.empty()) text = with_server(text, key_given("--trust", o.server));
  write_new_secret(o.file, text);
  print_line(to_text(o.issuer ? issuer_of(issuer) : public_of(secret)));
}

void show(const Options& o) {
  const KeyFile keys = read_key_file(o.file);
  if (keys.self) print_line(to_text(public_of(*keys.self)));
  if (keys.issuer_self) print_line(to_text(issuer_of(*keys.issuer_self)));
  if (!keys.self && !keys.issuer_self) throw InputError(o.file, "has no key of its own", "a line self SECRET");
}

void trust(const Options& o) {
  const PublicKey server = key_given("SERVER", o.server);
  change_secret(o.file, [&](const std::string& text) {
    parse_keys(text, o.file);
    return with_server(text, server);
  });
}

/// Refuses the file of a station or issuer, and a station that the server's file cannot hold in addition to the others.
void check_admits(const KeyFile& keys, const Options& o, const PublicKey& station) {
  constexpr char kServersFile[] = "the server's key file, which palpate-server gets as --keys";
  if (keys.server) throw InputError(o.file, "is a station's key file: it has a line server", kServersFile);
  if (!keys.self) throw InputError(o.file, "has no key of a server: no line self", kServersFile);
  if (public_of(*keys.self) == station)
    throw InputError("STATION", "is the key of " + o.file + " itself, the server's", "the key that the station printed");
  if (const auto there = keys.stations.find(station); there != keys.stations.end())
    throw InputError("STATION", "is in " + o.file + " already, as " + in_quotes(there->second.name),
                     "another key, or that line removed first");
  if (const auto other = name_like(keys, o.name))
    throw InputError("NAME", in_quotes(o.name) + " and " + in_quotes(*other) + " of " + o.file + " could have the same name",
                     kNamesApart);
}

void admit(const Options& o) {
  const PublicKey station = key_given("STATION", o.station);
  const std::string line = station_line(station, rights_given(o, "NAME"));
  change_secret(o.file, [&](std::string text) {
    const KeyFile keys = parse_keys(text, o.file);
    check_admits(keys, o, station);
    if (!text.empty() && text.back() != '\n') text += '\n';
    return text + line + "\n";
  });
  print_line(
      o.file + ": " + line +
      "\nThe line was added. A running server rereads the file at SIGHUP: systemctl reload palpate-server, or kill -HUP PID");
}

void issue(const Options& o) {
  const KeyFile keys = read_key_file(o.issuer_file);
  if (!keys.issuer_self) throw InputError(o.issuer_file, "has no issuer's key", "a file that palpate-key new --issuer made");
  const PublicKey server = key_given("--server", o.server), station = key_given("--station", o.station);
  Token token;
  system_random()(token.id);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  token.join_before_s = std::chrono::duration_cast<std::chrono::seconds>(now).count() + o.join_within_s;
  token.session_s = static_cast<std::uint32_t>(o.session_s);
  token.rights = rights_given(o, "--name");
  if (token.rights.rooms.size() > 1) throw InputError("--room", "is there twice", "one room for a token, or none for any");
  print_line(to_text(Bytes(sign_token(token, *keys.issuer_self, server, station))));
}

void add_rights(CLI::App& app, Options& o) {
  app.add_option("--role", o.roles,
                 "roles that the station may have, separated by commas: a hand touches, a viewer watches, a hand that is also a "
                 "guide may lead the hands of others, a viewer with note may write notes into the recording")
      ->type_name("hand|viewer|hand,viewer|hand,guide|viewer,note|...")
      ->capture_default_str();
  app.add_option("--room", o.rooms, "room that the station may join; repeated for further rooms; default: any")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--kbit-s", o.kbit_s, "highest data rate of shapes for a viewer [kbit/s]")
      ->check(number_from(1, kMostKbit))
      ->capture_default_str();
  app.add_option("--streams", o.streams,
                 "number of stations and viewers with this key at the same time; for a token: number of sessions in total")
      ->check(number_from(1, kMostStreams));
}

CLI::App* add_command(CLI::App& app, const char* name, const char* text) {
  CLI::App* command = app.add_subcommand(name, text);
  command->set_help_flag("-h,--help", "print this help and end");
  return command;
}

/// Adds an argument that is typed without a flag.
void add_operand(CLI::App& command, const char* name, std::string& value, const char* text) {
  command.add_option(name, value, text)->required()->type_name(name)->option_text("REQUIRED");
}

void add_commands(CLI::App& app, Options& o) {
  CLI::App* command =
      add_command(app, "new", "write a new key to a file that only its owner can read, and print the public half");
  add_operand(*command, "FILE", o.file, "key file, which must not exist yet");
  command->add_option("--trust", o.server, "public key of the server that this station trusts, as `trust` would add it")
      ->type_name("PUBLIC");
  command->add_flag("--issuer", o.issuer, "make the key of an issuer, which signs tokens");
  command->callback([&o] { make_new(o); });

  command = add_command(app, "trust", "add to a station's key file the server that it trusts");
  add_operand(*command, "FILE", o.file, "key file of the station");
  add_operand(*command, "SERVER", o.server, "public key of the server");
  command->callback([&o] { trust(o); });

  command =
      add_command(app, "admit", "admit a station: add a line to a server's key file (a running server rereads it at SIGHUP)");
  add_operand(*command, "FILE", o.file, "key file of the server");
  add_operand(*command, "STATION", o.station, "public key of the station");
  add_operand(*command, "NAME", o.name, "name of the station in the room, for example \"OR 3\"");
  add_rights(*command, o);
  command->callback([&o] { admit(o); });

  command = add_command(app, "show", "print the public half of a key file");
  add_operand(*command, "FILE", o.file, "any key file");
  command->callback([&o] { show(o); });

  command = add_command(app, "issue", "sign and print a token, by which one station may join one server once");
  command->add_option("--issuer", o.issuer_file, "key file of the issuer, whose public half is in the server's")
      ->type_name("FILE")
      ->required();
  command->add_option("--server", o.server, "public key of the server")->type_name("PUBLIC")->required();
  command->add_option("--station", o.station, "public key of the station")->type_name("PUBLIC")->required();
  command->add_option("--name", o.name, "name of the station in the room")->type_name("NAME")->required();
  command->add_option("--join-within-s", o.join_within_s, "time from now within which the station must join [s]")
      ->check(number_from(1, kLongestSession))
      ->capture_default_str();
  command->add_option("--session-s", o.session_s, "longest duration of the session [s]")
      ->check(number_from(1, kLongestSession))
      ->capture_default_str();
  add_rights(*command, o);
  command->callback([&o, command] {
    if (command->count("--streams") == 0) o.streams = 1;
    issue(o);
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("keys of servers and stations, and tokens that admit a station", "palpate-key");
  describe_program(app, PALPATE_VERSION,
                   "palpate-key new site.keys\n"
                   "  palpate-key new or3.key --trust SERVER\n"
                   "  palpate-key admit site.keys STATION \"OR 3\" --room liver");
  Options options;
  add_commands(app, options);
  app.require_subcommand(1);
  return run_program(app, [&] {
    app.parse(argc, argv);
    return 0;
  });
}
