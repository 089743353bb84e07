// Decides when a client abandons an address that does not answer: a server may have moved, or the NAT binding of our port (or
// another entry of connection tracking) may have expired. The remedy for both is to resolve the name again and to continue from a
// new port.
//
//     silence(now) = now - max(last answer, last move)    the name is resolved kAskAhead before kMoveAfter, and every kMoveAfter
//                                                         from then on; at kMoveAfter the client moves to another address if one
//                                                         was found, and to a new port for the old one after kMoveAfter, twice
//                                                         that, four times, at most kPortAfterMost
//
// A handshake with keys needs three round trips, and its progress is lost with the port: the waits grow until they are longer.
// When a name has no address any more, the client stays at the old one; a resolver that needs longer than another kMoveAfter is
// not waited for. A client whose server reports that it is shutting down resolves the name at once.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "client/io/name_lookup.hpp"
#include "common/base/types.hpp"

namespace palpate {

/// Returns the address of HOST:PORT from `--server`; InputError when it is none, or does not resolve. May block for seconds.
inline UdpEndpoint server_at(const std::string& text) {
  const UdpEndpoint server = resolve_udp("--server", text);
  if (server.port() == 0) throw InputError("--server", "port 0", "the server's port, 1 to 65535");
  return server;
}

inline constexpr Micros kNoAnswerAfter{1'000'000};  ///< silence of a server after which a program says that nobody answers

/// Says why a server at HOST:PORT may not have answered. `nobody_listens`: its machine reports that nothing listens at its port.
inline std::string no_answer_text(const std::string& server, bool nobody_listens, bool with_key) {
  if (nobody_listens) return "nothing listens at " + server;
  return "no answer from " + server +
         (with_key ? " (a server answers only keys that it knows; one that runs without --keys, clients without --key)"
                   : " (do datagrams pass both ways?)");
}

class ServerFinder {
 public:
  static constexpr Micros kMoveAfter{3'000'000}, kAskAhead{500'000}, kPortAfterMost{24'000'000};

  /// `at`: the address to which the name resolved by `now`.
  ServerFinder(std::string name, UdpEndpoint at, NameLookup::Ask ask, Micros now)
      : name_(std::move(name)), at_(std::move(at)), lookup_(std::move(ask)), moved_(now) {}

  /// Returns the address to continue with, from a new port; empty while all is well. `sent_away`: the server reports that it is
  /// shutting down.
  std::optional<UdpEndpoint> move(Micros now, Micros answered, bool sent_away) {
    if (answered > moved_) port_after_ = kMoveAfter;
    const Micros silence = now - (sent_away ? moved_ : std::max(answered, moved_));
    if (silence < kMoveAfter - kAskAhead) {
      asked_ = false;  // an address found during an earlier silence is out of date in the next
      found_.reset();
      lookup_.take();
      return std::nullopt;
    }
    if (!asked_ && !lookup_.busy()) lookup_.begin(name_);
    if (!std::exchange(asked_, true)) asked_at_ = now;
    if (const auto answer = lookup_.take()) found_ = answer->value_or(at_);
    if (silence < kMoveAfter || (!found_ && now - asked_at_ < kMoveAfter)) return std::nullopt;
    const UdpEndpoint to = found_.value_or(at_);
    const bool stays = to == at_;
    if (!stays || silence >= port_after_ || now - asked_at_ >= kMoveAfter) {
      asked_ = false;
      found_.reset();
    }
    if (stays && silence < port_after_) return std::nullopt;
    port_after_ = stays ? std::min(2 * port_after_, kPortAfterMost) : kMoveAfter;
    at_ = to;
    moved_ = now;
    return at_;
  }

 private:
  std::string name_;
  UdpEndpoint at_;
  NameLookup lookup_;
  Micros moved_, port_after_ = kMoveAfter;
  bool asked_ = false;  ///< true: the name was asked for since the last move
  Micros asked_at_{};
  std::optional<UdpEndpoint> found_;
};

}  // namespace palpate
