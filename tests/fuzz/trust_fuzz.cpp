// Arbitrary bytes to either end of the trust channel, in any order: neither crashes, a stranger gets no more bytes than it sends,
// and nothing is opened that was not sealed.
//
// Each input is a run: a byte gives receiver and sender, two give the number of bytes that follow. A station joins beforehand, so
// that live sessions and a running handshake can be hit; its own datagrams can be selected, and arrive changed.
#include "tests/fuzz/joined_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Stage {
  JoinedPair pair;
  std::vector<Datagram> genuine;

  Stage() {
    pair.now += Micros{120'000'000};
    genuine = pair.from_client();
    genuine.push_back(pair.sealed("up"));
    genuine.push_back(pair.sealed_by_server(pair.peer, "down"));
    pair.to_server(genuine.at(0));
    for (const Datagram& answer : pair.from_server()) genuine.push_back(answer);
  }

  void act(Script& script) {
    const std::size_t what = script.number(1);
    Datagram datagram = next(script);
    pair.now += Micros{static_cast<std::int64_t>(what) * 1000};
    if ((what & 1) != 0) return to_client(datagram);
    const bool sealed = pair.take(datagram, static_cast<int>(what >> 4)).opened.has_value();
    require(!sealed || datagram == genuine.at(1));
  }
  void to_client(const Datagram& datagram) {
    require(pair.to_client(datagram) == 0 || datagram == genuine.at(2));
    pair.from_client();
  }
  /// Bytes of the script, or one of our datagrams overwritten by some of them.
  Datagram next(Script& script) {
    const std::size_t which = script.number(1), at = script.number(2);
    const Bytes bytes = script.bytes(script.number(2) % 1400);
    if (which >= genuine.size()) return {bytes.begin(), bytes.end()};
    Datagram datagram = genuine[which];
    for (std::size_t k = 0; k < bytes.size() && at + k < datagram.size(); ++k) datagram[at + k] ^= bytes[k];
    return at > 1400 ? Datagram(datagram.begin(), datagram.begin() + static_cast<long>(at % datagram.size())) : datagram;
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Stage stage;
  Script script(data, size);
  while (!script.ended()) stage.act(script);
  return 0;
}
