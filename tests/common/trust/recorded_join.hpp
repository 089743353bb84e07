// The datagrams of a station that joins.
#pragma once

#include "tests/common/trust/channel_pair.hpp"

namespace palpate::test {

/// One datagram of each kind that a join sends, in the order sent: Init, Cookie, Init, Resp, Data.
struct Recorded {
  ChannelPair pair;
  Datagram asking, cookie, init, resp, data;
  Recorded() {
    asking = pair.from_client().at(0);
    pair.to_server(asking);
    cookie = pair.from_server().at(0);
    pair.to_client(cookie);
    init = pair.from_client().at(0);
    pair.to_server(init);
    resp = pair.from_server().at(0);
  }
};

}  // namespace palpate::test
