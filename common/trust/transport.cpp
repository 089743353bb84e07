#include "common/trust/transport.hpp"

namespace palpate {

std::size_t Transport::seal(Bytes plain, BytesOut out, ChannelKind kind) {
  const std::size_t size = plain.size() + kDataOverhead;
  if (out.size() < size) return 0;
  put_head(out, kind, other_);
  put_number(out.subspan(kHeadBytes, 8), sealed_);
  seal_bytes(send_, sealed_++, out.first(kDataHeadBytes), plain, out.subspan(kDataHeadBytes, plain.size() + kTagBytes));
  return size;
}

OpenFault Transport::open(Bytes datagram, BytesOut plain, bool& newest) {
  const std::uint64_t counter = number_at(datagram.subspan(kHeadBytes, 8));
  if (!window_.is_fresh(counter)) return OpenFault::replayed;
  if (!open_bytes(receive_, counter, datagram.first(kDataHeadBytes), datagram.subspan(kDataHeadBytes), plain))
    return OpenFault::forged;
  newest = window_.mark(counter);
  return OpenFault::none;
}

}  // namespace palpate
