// The addresses at which a session's client is known to receive.
//
// An address is proven by a cookie that was sent to it and came back: that of the Init, or one in a Path, sealed both ways.
// Nothing else is sent to an unproven address; a proven one is served from when the newest counter comes from it. Proofs expire
// with the keys under which they were made, except for the addresses of the Init that made the next keys: so an attacker at an
// address that the client has left is trusted for seven minutes at most (a cookie of an Init four, a pair of keys three).
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/trust/channel_wire.hpp"

namespace palpate {

class Paths {
 public:
  static constexpr std::size_t kMost = 4;  ///< those served last; a client with more addresses proves one again

  /// Notes that the Init of the next keys came from here, with a valid cookie. `first`: true for a new handshake.
  void came_with_cookie(const ChannelAddress& from, bool first) {
    if (first) next_.clear();
    put_first(next_, from);
  }
  /// Notes that the next keys are in use.
  void use_next() { shown_ = std::exchange(next_, {}); }
  /// Notes that the newest counter came from this address. Returns false when it is unproven.
  bool hear(const ChannelAddress& from) {
    newest_ = from;
    if (!shown_.empty() && shown_.front() == from) return true;
    if (std::find(shown_.begin(), shown_.end(), from) == shown_.end()) return false;
    put_first(shown_, from);
    return true;
  }
  /// Notes that a cookie sent to this address came back.
  void show(const ChannelAddress& address) {
    if (std::find(shown_.begin(), shown_.end(), address) != shown_.end()) return;
    put_first(shown_, address);
    if (newest_ != address && shown_.size() > 1) std::swap(shown_[0], shown_[1]);
  }
  /// Destination of answers; only with keys in use.
  const ChannelAddress& served() const { return shown_.front(); }

 private:
  static void put_first(std::vector<ChannelAddress>& all, const ChannelAddress& address) {
    std::erase(all, address);
    all.insert(all.begin(), address);
    if (all.size() > kMost) all.pop_back();
  }

  std::vector<ChannelAddress> shown_, next_;  ///< newest first
  ChannelAddress newest_;
};

}  // namespace palpate
