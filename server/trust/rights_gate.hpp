// Between the trust channel and the rooms: what a message may ask for, by the rights of who sent it.
//
//     Hello      role, room and name within the rights; a shadow only of a tool of the same key; no more streams than the key has
//     ViewState  kbit/s at most
//     Reset      of keys that may touch: who looks on takes nobody's body out of his hands
//
// A session is one station: a Hello for another one than before ends that, so that nobody has more stations than streams.
// An older session of the same key and station is no stream more: the room knows which of the two has the name (sessions.hpp).
// A station that leaves name or room open gets what it has a right to. Of two keys whose stations could have the same name
// (tokens may say so) the second waits until the first has gone: a name in a room belongs to one key.
#pragma once

#include <map>
#include <optional>

#include "common/trust/server_channel.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// What becomes of a message.
struct Ruling {
  std::optional<Refuse> refused = {};
  bool anew = false;  ///< what its session had in the rooms until now goes
};

class RightsGate {
 public:
  /// Changes in the message what is to be changed.
  Ruling cap(Message& message, ChannelPeer from, const PublicKey& key, const Rights& rights, Micros now);
  void forget(ChannelPeer peer) { streams_.erase(peer); }

 private:
  struct Stream {
    PublicKey key;
    Rights rights;
    Micros heard{};
    Hello hello;  ///< as it was granted
  };
  std::optional<Refuse> cap_hello(Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights, Micros now);
  std::optional<Refuse> cap_streams(const Hello& hello, ChannelPeer from, const PublicKey& key, const Rights& rights,
                                    Micros now) const;

  std::map<ChannelPeer, Stream> streams_;  ///< sessions in a room, as far as is known here
};

}  // namespace palpate
