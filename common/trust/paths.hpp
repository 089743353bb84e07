// Where a session's client receives.
//
// An address is shown by a cookie that went there and came back: that of the Init, or one in a Path, sealed both ways. Nothing
// else goes to one that is not; a shown one is served from when the newest counter comes from it. What was shown is forgotten
// with the keys under which it was, but for the addresses of the Init that made the next: so a client that has left an address
// and goes on in its name is believed for seven minutes at most (a cookie of an Init four, a pair of keys three).
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/trust/channel_wire.hpp"

namespace palpate {

class Paths {
 public:
  static constexpr std::size_t kMost = 4;  ///< those that were served last; a client that has more shows one anew

  /// The Init that the next keys are of came from here, with the cookie for it. `first`: of a new handshake.
  void came_with_cookie(const ChannelAddress& from, bool first) {
    if (first) next_.clear();
    put_first(next_, from);
  }
  /// The next keys are those in use.
  void use_next() { shown_ = std::exchange(next_, {}); }
  /// The newest counter came from there. False where that is not shown.
  bool hear(const ChannelAddress& from) {
    newest_ = from;
    if (!shown_.empty() && shown_.front() == from) return true;
    if (std::find(shown_.begin(), shown_.end(), from) == shown_.end()) return false;
    put_first(shown_, from);
    return true;
  }
  /// A cookie that went there came back.
  void show(const ChannelAddress& address) {
    if (std::find(shown_.begin(), shown_.end(), address) != shown_.end()) return;
    put_first(shown_, address);
    if (newest_ != address && shown_.size() > 1) std::swap(shown_[0], shown_[1]);
  }
  /// Where answers go; only with keys in use.
  const ChannelAddress& served() const { return shown_.front(); }

 private:
  static void put_first(std::vector<ChannelAddress>& all, const ChannelAddress& address) {
    std::erase(all, address);
    all.insert(all.begin(), address);
    if (all.size() > kMost) all.pop_back();
  }

  std::vector<ChannelAddress> shown_, next_;  ///< the newest first
  ChannelAddress newest_;
};

}  // namespace palpate
