// Arbitrary treatment of the datagrams between two ends of the trust channel: everything delivered was sent by the other end, and
// is delivered once; and an address gets no more bytes than came from it before there is a session.
//
// Each input is a run. A byte selects the next event: one end or the other sends something; a datagram in flight arrives, once or
// again, changed or not, from its own address or another; a handshake begins; time passes, up to rekeying and beyond.
#include <set>

#include "tests/fuzz/joined_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr std::size_t kKept = 256;

/// One direction: messages sent and not delivered yet, and every datagram in flight so far.
struct Way {
  std::set<std::string> said;
  std::vector<Datagram> under_way;
  int count = 0;

  std::string next(const char* who) { return *said.insert(who + std::to_string(count++)).first; }
  void send(Datagram datagram) {
    if (datagram.empty()) return;
    if (under_way.size() == kKept) under_way.erase(under_way.begin());
    under_way.push_back(std::move(datagram));
  }
  void arrived(const std::string& text) { require(said.erase(text) == 1); }
};

class Stage {
 public:
  void act(Script& script) {
    const std::uint64_t what = script.number(1), how = what >> 4;
    switch (what & 15u) {
      case 0:
      case 1:
        return up_.send(pair_.sealed(up_.next("up ")));
      case 2:
      case 3:
        return down_.send(pair_.sealed_by_server(pair_.peer, down_.next("down ")));
      case 4:
      case 5:
        return to_server(chosen(up_, script), 0);
      case 6:
      case 7:
        return to_client(chosen(down_, script));
      case 8:
        return to_server(damaged(chosen(up_, script), script), how);
      case 9:
        return to_client(damaged(chosen(down_, script), script));
      case 10:
        return to_server(chosen(up_, script), how);
      case 11:
        return to_client(chosen(up_, script));  // reflected
      case 12:
        return to_server(chosen(down_, script), 0);  // reflected
      case 13:
        for (Datagram& datagram : pair_.from_client()) up_.send(std::move(datagram));
        return;
      case 14:
        return pass(Micros{std::int64_t{1000} << how});
      default:
        return raw(script, how);
    }
  }

 private:
  Datagram chosen(const Way& way, Script& script) const {
    const std::size_t which = script.number(1);
    if (way.under_way.empty()) return {};
    return way.under_way[way.under_way.size() - 1 - which % way.under_way.size()];
  }
  Datagram damaged(Datagram datagram, Script& script) const {
    script.damage(std::span(datagram));
    return datagram;
  }
  void pass(Micros time) {
    pair_.now += time;
    pair_.unix_s += time.count() / 1'000'000;
    pair_.server.tick(pair_.now);
    pair_.client.tick(pair_.now);
    for (const ChannelPeer ended : pair_.server.take_ended()) pair_.server.forget(ended);
  }
  void raw(Script& script, std::uint64_t how) {
    const auto bytes = script.bytes(script.number(2) % 1400);
    const Datagram datagram(bytes.begin(), bytes.end());
    how % 2 == 0 ? to_server(datagram, how) : to_client(datagram);
  }
  void to_server(const Datagram& datagram, std::uint64_t from) {
    auto taken = pair_.take(datagram, 1 + static_cast<int>(from));
    if (taken.opened) {
      pair_.peer = taken.opened->peer;
      if (taken.opened->size > 0) up_.arrived(pair_.text(taken.opened->size));
    }
    for (Datagram& answer : taken.answers) down_.send(std::move(answer));
  }
  void to_client(const Datagram& datagram) {
    if (const std::size_t size = pair_.to_client(datagram); size > 0) down_.arrived(pair_.text(size));
  }

  JoinedPair pair_;
  Way up_, down_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Stage stage;
  Script script(data, size);
  while (!script.ended()) stage.act(script);
  return 0;
}
