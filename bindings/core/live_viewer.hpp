// A viewer at a server in real time: the body's shape and topology, and the tools on it, for programs that draw or compute by
// themselves.
//
//     LiveViewer viewer({.server = "127.0.0.1:47800"});
//     viewer.wait(Micros{5'000'000});                           // the mesh and a first shape have arrived
//     for each picture: if (viewer.update(Micros{0})) draw(viewer.mesh(), *viewer.moment());
//
// update() pumps the session (client/io/udp_viewer.hpp): call it at least four times a second. One thread at a time. Metres,
// newtons, frame W.
#pragma once

#include <memory>
#include <string>

#include "client/io/udp_viewer.hpp"

namespace palpate {

struct ViewerOptions {
  std::string server;                          ///< HOST:PORT
  std::string station = "viewer";              ///< name; the server assigns a similar one when it is in use
  std::string room = {};                       ///< one of the server's rooms; empty: its first
  std::string key_file = {}, token_file = {};  ///< empty: none
};

class LiveViewer {
 public:
  /// Begins to join. Throws InputError for an address or key that cannot be read.
  explicit LiveViewer(const ViewerOptions& options);

  /// Pumps until there is something to show. Throws std::runtime_error when the server refuses the viewer, or after `most`, with
  /// the reason.
  void wait(Micros most);
  /// Pumps for `most`, at least once, and then shows the moment that is due. Returns false while there is none.
  bool update(Micros most);

  /// The surface at rest; valid after wait(). A new one, with another version, follows when the server's body changes.
  const BodyMesh& mesh() const { return udp_.core().mesh(); }
  std::uint64_t mesh_version() const { return udp_.core().mesh_version(); }
  /// The moment of the last update(), which it does not change any more; null before the first.
  const std::shared_ptr<const ViewMoment>& moment() const { return moment_; }
  const Welcome& welcome() const { return udp_.core().welcome(); }

 private:
  UdpViewer udp_;
  std::shared_ptr<const ViewMoment> moment_;
};

}  // namespace palpate
