#include "common/trust/server_channel.hpp"

#include <algorithm>

namespace palpate {
namespace {

constexpr Micros kSweepSessionsEvery{250'000};
constexpr Micros kSecond{1'000'000};
constexpr std::int64_t kTokenKeptS = 3600;           ///< beyond its end, in case the wall clock is set back
constexpr std::int64_t kTokenLeadS = 1'000'000'000;  ///< largest time ahead

template <std::size_t n>
std::array<std::uint8_t, n> copy_of(Bytes bytes) {
  std::array<std::uint8_t, n> out{};
  std::copy_n(bytes.begin(), std::min(n, bytes.size()), out.begin());
  return out;
}

}  // namespace

const char* describe(ChannelFault fault) {
  static constexpr std::array<const char*, kChannelFaults> kText{"malformed",
                                                                 "made without this server's key",
                                                                 "too many handshakes",
                                                                 "for another server, or changed on the way",
                                                                 "key not known",
                                                                 "token not valid",
                                                                 "token expired",
                                                                 "token used already",
                                                                 "stale",
                                                                 "too many sessions",
                                                                 "no such session",
                                                                 "replayed",
                                                                 "forged"};
  const auto k = static_cast<std::size_t>(fault);
  return k < kText.size() ? kText[k] : "unknown";
}

ServerChannel::ServerChannel(SiteKeys keys, DrawBytes draw, UnixSeconds unix_now, const ChannelTimes& times)
    : keys_(std::move(keys)),
      self_(public_of(keys_.self)),
      mac1_key_(mac1_key_of(self_)),
      draw_(draw),
      unix_now_(std::move(unix_now)),
      times_(times),
      cookies_(draw),
      path_cookies_(std::move(draw), kPathLasts) {}

std::optional<ServerChannel::Opened> ServerChannel::fail(ChannelFault fault) {
  ++counts_.faults[static_cast<std::size_t>(fault)];
  return std::nullopt;
}

void ServerChannel::refuse(ChannelFault fault, const ChannelAddress& from, const PublicKey* key) {
  fail(fault);
  refusal_ = {fault, from, key != nullptr ? std::optional(*key) : std::nullopt};
}

void ServerChannel::answer(const ChannelAddress& to, Bytes bytes) {
  if (answers_.size() >= kMostAnswers) return;
  answers_.push_back({to, copy_of<kMostAnswerBytes>(bytes), bytes.size()});
}

std::size_t ServerChannel::emit(BytesOut out, ChannelAddress& to) {
  if (answers_.empty()) return 0;
  const Answer next = answers_.front();
  answers_.pop_front();
  std::copy_n(next.bytes.begin(), next.size, out.begin());
  to = next.to;
  return next.size;
}

std::optional<ServerChannel::Opened> ServerChannel::take(Bytes datagram, const ChannelAddress& from, Micros now, BytesOut plain) {
  const auto kind = kind_of(datagram);
  const bool is_data = kind == ChannelKind::data && datagram.size() >= kDataOverhead && datagram.size() <= kMaxSealedBytes;
  if (is_data || (kind == ChannelKind::path && datagram.size() == kPathBytes)) return take_data(datagram, from, now, plain);
  if (kind != ChannelKind::init || datagram.size() != kInitBytes) return fail(ChannelFault::malformed);
  take_init(datagram, from, now);
  return std::nullopt;
}

/// Handles an Init: checks that cost next to nothing come first.
void ServerChannel::take_init(Bytes datagram, const ChannelAddress& from, Micros now) {
  if (!same_bytes(keyed_mac(mac1_key_, signed_part(datagram)), datagram.subspan(kInitSigned, kMacBytes)))
    return refuse(ChannelFault::mac, from, nullptr);
  const std::uint32_t index = index_of(datagram);
  if (!cookies_.fits(datagram.last(kMacBytes), from, index, now)) {
    std::array<std::uint8_t, kCookieBytes> cookie;
    put_head(cookie, ChannelKind::cookie, index);
    const Mac mac = cookies_.cookie_for(from, index, now);
    std::copy(mac.begin(), mac.end(), cookie.begin() + kHeadBytes);
    ++counts_.cookies;
    return answer(from, cookie);
  }
  const auto mac = copy_of<kMacBytes>(datagram.subspan(kInitSigned, kMacBytes));
  Neighbour lives = Neighbour::none;
  for (auto& [peer, session] : sessions_) {
    if (session.answered == mac) {  // the answer was lost, or is late
      if (session.next) session.paths.came_with_cookie(from, false);
      return answer(from, session.answer);
    }
    if (!session.confirmed || session.paths.served().ip != from.ip) continue;
    const Neighbour near = session.paths.served().port == from.port ? Neighbour::session : Neighbour::session_of_host;
    lives = std::max(lives, near);
  }
  if (stale_.contains(mac)) return refuse(ChannelFault::stale, from, nullptr);
  if (!limits_.may_look(from, lives, now)) return refuse(ChannelFault::limit, from, nullptr);
  shake_hands(datagram, mac, from, lives, now);
}

void ServerChannel::remember_stale(const Mac& mac) {
  if (!stale_.insert(mac).second) return;
  stale_in_order_.push_back(mac);
  if (stale_in_order_.size() <= kMostStale) return;
  stale_.erase(stale_in_order_.front());
  stale_in_order_.pop_front();
}

void ServerChannel::shake_hands(Bytes datagram, const Mac& mac, const ChannelAddress& from, Neighbour lives, Micros now) {
  const Bytes message = datagram.subspan(kHeadBytes, kInitSigned - kHeadBytes);
  NoiseResponder noise(keys_.self, self_, datagram.first(kHeadBytes));
  if (!noise.read_sender(message)) return refuse(ChannelFault::handshake, from, nullptr);
  const PublicKey key = noise.sender();
  const bool known = keys_.stations.contains(key);
  if (!known && keys_.issuers.empty()) return refuse(ChannelFault::unknown_key, from, &key);
  if (!(known ? limits_.may_go_on(key, lives, now) : limits_.may_try_token(from, lives, now)))
    return refuse(ChannelFault::limit, from, &key);
  std::array<std::uint8_t, kInitPayloadBytes> bytes;
  if (!noise.read_payload(message, bytes)) return refuse(ChannelFault::handshake, from, nullptr);
  const auto payload = unpack_init(bytes);
  if (!payload) return refuse(ChannelFault::malformed, from, &key);

  Session* session = find(key, payload->session);
  if (session != nullptr && payload->attempt <= session->attempt) {
    remember_stale(mac);
    return refuse(ChannelFault::stale, from, &key);
  }
  ChannelFault why{};
  const auto admission = admit(key, *payload, session, now, why);
  if (!admission) return refuse(why, from, &key);
  if (session == nullptr) {
    if (!make_room_for(key, admission->rights.streams, now)) return refuse(ChannelFault::full, from, &key);
    session = &sessions_[++last_];
    session->peer = last_;
    session->key = key;
    session->number = payload->session;
    session->heard = now;
  }
  session->rights = admission->rights;
  session->by_token = admission->by_token;
  session->ends = admission->ends;
  session->issuer = admission->issuer;
  session->begun = now;
  session->attempt = payload->attempt;
  session->answered = mac;
  session->paths.came_with_cookie(from, true);

  const std::uint32_t index = draw_index();
  std::array<std::uint8_t, 4> index_bytes;
  put_number(index_bytes, index);
  put_head(session->answer, ChannelKind::resp, index_of(datagram));
  drop_keys(session->next);
  if (!noise.write(draw_secret(draw_), index_bytes, BytesOut(session->answer).subspan(kHeadBytes)))
    return refuse(ChannelFault::handshake, from, &key);
  const NoiseKeys keys = noise.split();
  session->next.emplace(keys.down, keys.up, index, index_of(datagram), now);
  indices_[index] = session->peer;
  ++counts_.answers;
  answer(from, session->answer);
}

std::optional<ServerChannel::Admission> ServerChannel::admit(const PublicKey& key, const InitPayload& payload, Session* known,
                                                             Micros now, ChannelFault& why) {
  if (const auto found = keys_.stations.find(key); found != keys_.stations.end())
    return Admission{found->second, false, Micros::max(), {}};
  return admit_token(key, payload, known, now, why);
}

/// Checks a token. A running session does not need a valid one again.
std::optional<ServerChannel::Admission> ServerChannel::admit_token(const PublicKey& key, const InitPayload& payload,
                                                                   Session* known, Micros now, ChannelFault& why) {
  if (known != nullptr && known->by_token) return Admission{known->rights, true, known->ends, known->issuer};
  why = payload.token.empty() ? ChannelFault::unknown_key : ChannelFault::token;
  const auto token = verify_token(payload.token, keys_.issuers, self_, key);
  if (!token) return std::nullopt;
  const std::int64_t now_s = unix_now_();
  why = ChannelFault::token_expired;
  if (now_s > token->join_before_s) return std::nullopt;
  why = ChannelFault::token_used;
  if (used_.size() >= kMostTokens && !used_.contains(token->id)) return std::nullopt;
  UsedToken& used = used_[token->id];
  const auto before = used.sessions.find(payload.session);
  const bool there = before != used.sessions.end();
  if (there ? now >= before->second : used.sessions.size() >= static_cast<std::size_t>(token->rights.streams))
    return std::nullopt;
  const Micros ends = there ? before->second : now + kSecond * token->session_s;
  used.until = now + kSecond * (std::min(token->join_before_s - now_s, kTokenLeadS) + kTokenKeptS);
  used.sessions.emplace(payload.session, ends);
  return Admission{token->rights, true, ends, token->issuer};
}

ServerChannel::Session* ServerChannel::find(const PublicKey& key, std::uint64_t number) {
  for (auto& [peer, session] : sessions_)
    if (!session.ending && session.number == number && session.key == key) return &session;
  return nullptr;
}

/// Makes room for another session of this key; if needed, the one that has been silent longest is removed. Handshakes without
/// Data have separate places, of which the oldest is removed: an attacker may replay recorded handshakes, but cannot displace a
/// client that continues with Data.
bool ServerChannel::make_room_for(const PublicKey& key, int streams, Micros now) {
  int of_key = 0, unconfirmed = 0;
  Session *silent = nullptr, *oldest = nullptr;
  for (auto& [peer, session] : sessions_) {
    if (session.key != key || session.ending) continue;
    if (!session.confirmed) {
      ++unconfirmed;
      if (oldest == nullptr || session.begun < oldest->begun) oldest = &session;
      continue;
    }
    ++of_key;
    if (now - session.heard > kSilent && (silent == nullptr || session.heard < silent->heard)) silent = &session;
  }
  if (unconfirmed >= kSpareSessions) end(*oldest);
  if (of_key < streams + kSpareSessions && sessions_.size() < kMostSessions) return true;
  if (silent == nullptr) return false;
  end(*silent);
  return sessions_.size() < kMostSessions;
}

std::optional<ServerChannel::Opened> ServerChannel::take_data(Bytes datagram, const ChannelAddress& from, Micros now,
                                                              BytesOut plain) {
  const std::uint32_t index = index_of(datagram);
  const auto found = indices_.find(index);
  Session* session = found != indices_.end() ? &sessions_.at(found->second) : nullptr;
  Transport* keys = session != nullptr ? keys_at(*session, index, now) : nullptr;
  if (keys == nullptr) {
    if (!hint_limits_.allow(from, Neighbour::none, now)) return fail(ChannelFault::index);
    std::array<std::uint8_t, kHintBytes> hint;
    put_head(hint, ChannelKind::hint, index);
    ++counts_.hints;
    answer(from, hint);
    return fail(ChannelFault::index);
  }
  const std::size_t size = datagram.size() - kDataOverhead;
  bool newest = false;
  const OpenFault fault = keys->open(datagram, plain.first(size), newest);
  if (fault != OpenFault::none) return fail(fault == OpenFault::replayed ? ChannelFault::replayed : ChannelFault::forged);
  if (session->next && keys == &*session->next) confirm(*session, now);
  session->heard = now;
  const ChannelAddress before = session->paths.served();
  const bool is_path = kind_of(datagram) == ChannelKind::path;
  if (is_path) take_path(*session, plain.first(size), now);
  const bool leads = newest && session->current->own_index() == index;
  const bool shown = !leads || follow(*session, from, is_path ? 0 : datagram.size(), now);
  counts_.moves += session->paths.served() != before;
  if (is_path) return std::nullopt;
  ++counts_.opened;
  return Opened{session->peer, size, shown};
}

/// Notes that the newest counter came from there, in a datagram of that size. Returns true where its client is known to receive
/// there.
bool ServerChannel::follow(Session& session, const ChannelAddress& from, std::size_t bytes, Micros now) {
  if (session.paths.hear(from)) return true;
  if (bytes >= kPathBytes && (from != session.asked || now >= session.ask_again)) ask(session, from, now);
  return false;
}

void ServerChannel::ask(Session& session, const ChannelAddress& from, Micros now) {
  session.asked = from;
  session.ask_again = now + kAskEvery;
  std::array<std::uint8_t, kPathBytes> path;
  session.current->seal(pack_path(from, path_cookies_.cookie_for(from, session.current->own_index(), now)), path,
                        ChannelKind::path);
  ++counts_.paths;
  answer(from, path);
}

void ServerChannel::take_path(Session& session, Bytes text, Micros now) {
  const ChannelAddress address = address_of_path(text);
  if (path_cookies_.fits(cookie_of_path(text), address, session.current->own_index(), now)) session.paths.show(address);
}

Transport* ServerChannel::keys_at(Session& session, std::uint32_t index, Micros now) {
  if (session.ending) return nullptr;
  for (std::optional<Transport>* slot : {&session.current, &session.next, &session.old})
    if (*slot && (*slot)->own_index() == index) {
      const bool kept = slot != &session.old || now < session.old_until;
      return kept && (*slot)->usable(now, times_) ? &**slot : nullptr;
    }
  return nullptr;
}

/// Switches to the new keys: the client has them.
void ServerChannel::confirm(Session& session, Micros now) {
  drop_keys(session.old);
  session.old = std::exchange(session.current, std::exchange(session.next, std::nullopt));
  session.old_until = now + times_.keep_old;
  session.paths.use_next();
  if (!std::exchange(session.confirmed, true)) ++counts_.sessions;
}

std::size_t ServerChannel::seal(ChannelPeer peer, Bytes plain, BytesOut out, ChannelAddress& to, Micros now) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end() || !found->second.current || !found->second.current->usable(now, times_)) return 0;
  to = found->second.paths.served();
  return found->second.current->seal(plain, out);
}

std::uint32_t ServerChannel::draw_index() {
  std::array<std::uint8_t, 4> bytes;
  do draw_(bytes);
  while (indices_.contains(static_cast<std::uint32_t>(number_at(bytes))));
  return static_cast<std::uint32_t>(number_at(bytes));
}

void ServerChannel::drop_keys(std::optional<Transport>& slot) {
  if (slot) indices_.erase(slot->own_index());
  slot.reset();
}

void ServerChannel::end(Session& session) {
  if (!session.confirmed) return forget(session.peer);
  if (!std::exchange(session.ending, true)) ended_.push_back(session.peer);
}

void ServerChannel::forget(ChannelPeer peer) {
  const auto found = sessions_.find(peer);
  if (found == sessions_.end()) return;
  for (std::optional<Transport>* slot : {&found->second.current, &found->second.next, &found->second.old}) drop_keys(*slot);
  sessions_.erase(found);
}

bool ServerChannel::is_over(const Session& session, Micros now) const {
  if (now >= session.ends) return true;
  return session.confirmed ? !session.current->usable(now, times_) : now - session.begun >= kUnconfirmed;
}

void ServerChannel::tick(Micros now) {
  if (now < next_sweep_) return;
  next_sweep_ = now + kSweepSessionsEvery;
  for (auto next = sessions_.begin(); next != sessions_.end();) {
    Session& session = (next++)->second;
    if (session.old && now >= session.old_until) drop_keys(session.old);
    if (!session.ending && is_over(session, now)) end(session);
  }
  std::erase_if(used_, [&](const auto& entry) { return now > entry.second.until; });
}

bool ServerChannel::still_believed(const Session& session) const {
  if (session.by_token) return std::find(keys_.issuers.begin(), keys_.issuers.end(), session.issuer) != keys_.issuers.end();
  const auto found = keys_.stations.find(session.key);
  return found != keys_.stations.end() && found->second == session.rights;
}

void ServerChannel::change_keys(SiteKeys keys) {
  const bool same_self = public_of(keys.self) == self_;
  keys_ = std::move(keys);
  self_ = public_of(keys_.self);
  mac1_key_ = mac1_key_of(self_);
  for (auto next = sessions_.begin(); next != sessions_.end();) {
    Session& session = (next++)->second;
    if (!same_self || !still_believed(session)) end(session);
  }
}

const Rights* ServerChannel::rights(ChannelPeer peer) const {
  const auto found = sessions_.find(peer);
  return found == sessions_.end() ? nullptr : &found->second.rights;
}

const PublicKey* ServerChannel::key(ChannelPeer peer) const {
  const auto found = sessions_.find(peer);
  return found == sessions_.end() ? nullptr : &found->second.key;
}

}  // namespace palpate
