// Limits the requests of messages, between the trust channel and the rooms, to the rights of their sender.
//
//     Hello      role, room and name within the rights; a shadow only of a tool of the same key; guidance only by keys
//                that may guide; no more streams than the key has
//     ViewState  kbit/s at most
//     Note       only from keys that may write notes
//     Reset      only from keys that may touch: a spectator cannot take the body out of anybody's hands
//
// A session is one station: a Hello for another station ends the one before, so that nobody has more stations than streams. An
// older session of the same key and station does not count as a stream; the room decides which of the two has the name
// (sessions.hpp). A station that leaves name or room open gets one that it has a right to. If the stations of two keys could have
// the same name (tokens may allow that), the second waits until the first has left: a name in a room belongs to one key.
#pragma once

#include <map>
#include <optional>

#include "common/trust/server_channel.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// Decision about a message.
struct Ruling {
  std::optional<Refuse> refused = {};
  bool anew = false;  ///< true: the session's previous station in the rooms is removed
};

class RightsGate {
 public:
  /// Decides about a message and reduces its requests to the rights.
  Ruling cap(Message& message, ChannelPeer from, const PublicKey& key, const Rights& rights, Micros now);
  void forget(ChannelPeer peer) { streams_.erase(peer); }

 private:
  struct Stream {
    PublicKey key;
    Rights rights;
    Micros heard{};
    Hello hello;  ///< the granted Hello
  };
  std::optional<Refuse> cap_hello(Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights, Micros now);
  std::optional<Refuse> cap_streams(const Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights,
                                    Micros now) const;

  std::map<ChannelPeer, Stream> streams_;  ///< sessions in a room, as far as known here
};

}  // namespace palpate
