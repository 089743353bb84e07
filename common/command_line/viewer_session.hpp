// Flags of a program that joins a room as a viewer: --key, --token, --station, --room and --kbit-s.
#pragma once

#include "common/command_line/flags.hpp"

namespace palpate {

/// Adds them. `options` has the strings key, token, station and room, and a number kbit_s; their values are the defaults.
template <typename Options>
void add_viewer_session(CLI::App& app, Options& options) {
  app.add_option("--key", options.key,
                 "key file of this viewer (palpate-key new), for a server with --keys; it contains the key of the trusted server")
      ->type_name("FILE");
  app.add_option("--token", options.token, "token from palpate-key issue, for a server whose key file does not contain this key")
      ->type_name("FILE");
  app.add_option("--station", options.station,
                 "name of this viewer, unique in the room; the server appends a number to the default name if it is taken")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--room", options.room, "name of the room on the server; default: its first")->type_name("NAME");
  app.add_option("--kbit-s", options.kbit_s, "highest data rate of shapes from the server [kbit/s]; 0: the server's default")
      ->capture_default_str()
      ->check(number_from(0, 65535));
}

}  // namespace palpate
