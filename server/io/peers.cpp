#include "server/io/peers.hpp"

namespace palpate {

std::optional<PeerId> Peers::id_of(const UdpEndpoint& address, Micros now) {
  auto known = ids_.find(address);
  if (known == ids_.end()) {
    if (ids_.size() >= kMost) forget_silent(now);
    if (ids_.size() >= kMost) return std::nullopt;
    known = ids_.emplace(address, Heard{++last_, now}).first;
    addresses_.emplace(last_, address);
  }
  known->second.at = now;
  return known->second.id;
}

const UdpEndpoint* Peers::address_of(PeerId id) const {
  const auto found = addresses_.find(id);
  return found == addresses_.end() ? nullptr : &found->second;
}

void Peers::forget_silent(Micros now) {
  std::erase_if(ids_, [&](const auto& entry) {
    if (now - entry.second.at < kForgetAfter) return false;
    addresses_.erase(entry.second.id);
    return true;
  });
}

}  // namespace palpate
