// Tokens: which stations may join, when, how often; and that nobody can forge a token or extend its rights.
#include <catch2/catch.hpp>

#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr std::uint64_t kIssuerSeed = 21, kOtherIssuerSeed = 22;
constexpr std::int64_t kNow = 1'800'000'000;

IssuerSecret issuer_secret(std::uint64_t seed) {
  IssuerSecret secret;
  secret.bytes = secret_of(seed).bytes;
  return secret;
}

PublicKey server_key() { return public_of(secret_of(kServerSeed)); }

Token token_for(int streams = 1) {
  Token token;
  seeded(31)(token.id);
  token.join_before_s = kNow + 60;
  token.session_s = 7200;
  token.rights = rights_of("OR 9");
  token.rights.viewer = false;
  token.rights.guide = token.rights.note = true;
  token.rights.rooms = {"liver"};
  token.rights.kbit_s = 500;
  token.rights.streams = streams;
  return token;
}

std::vector<std::uint8_t> signed_by(std::uint64_t issuer, std::uint64_t station, const Token& token = token_for()) {
  return sign_token(token, issuer_secret(issuer), server_key(), public_of(secret_of(station)));
}

SiteKeys site_with_issuer() {
  SiteKeys site = site_keys();
  site.issuers = {issuer_of(issuer_secret(kIssuerSeed))};
  return site;
}

ClientKeys stranger_with(std::vector<std::uint8_t> token) {
  ClientKeys keys = client_keys(kStrangerSeed);
  keys.token = std::move(token);
  return keys;
}

void new_life(ChannelPair& pair, const ClientKeys& keys, std::uint64_t seed) {
  pair.client = ClientChannel(keys, 5, seeded(seed), pair.now);
}

}  // namespace

TEST_CASE("a token lets a station in that the server does not know, with the rights in it") {
  const Token token = token_for();
  ChannelPair pair(site_with_issuer(), stranger_with(signed_by(kIssuerSeed, kStrangerSeed, token)));
  const ChannelPeer peer = pair.join();
  REQUIRE(peer != 0);
  CHECK(*pair.server.rights(peer) == token.rights);
}

TEST_CASE("the largest token has 230 bytes and comes through as it was signed") {
  Token token = token_for();
  token.rights.name = std::string(64, 'n');
  token.rights.rooms = {std::string(64, 'r')};
  const auto bytes = signed_by(kIssuerSeed, kStrangerSeed, token);
  CHECK(bytes.size() == 230);
  const std::vector<PublicKey> issuers{issuer_of(issuer_secret(kIssuerSeed))};
  const auto read = verify_token(bytes, issuers, server_key(), public_of(secret_of(kStrangerSeed)));
  REQUIRE(read);
  CHECK(read->id == token.id);
  CHECK(read->rights == token.rights);
  CHECK(read->join_before_s == token.join_before_s);
  CHECK(read->session_s == token.session_s);
  token.rights.name += 'n';
  CHECK(signed_by(kIssuerSeed, kStrangerSeed, token).empty());
}

TEST_CASE("a token whose name or room is not UTF-8 without control characters is none, whoever signed it") {
  const std::vector<PublicKey> issuers{issuer_of(issuer_secret(kIssuerSeed))};
  const auto is_good = [&](const Token& token) {
    const auto bytes = signed_by(kIssuerSeed, kStrangerSeed, token);
    return !bytes.empty() && verify_token(bytes, issuers, server_key(), public_of(secret_of(kStrangerSeed)));
  };
  Token token = token_for();
  token.rights.name = "M\xc3\xbcller";
  CHECK(is_good(token));
  for (const char* text : {"\xff", "M\xfcller", "c\xe2\x82", "\xc2\x9b", "a\tb", "\x7f"}) {
    CAPTURE(text);
    Token named = token_for(), of_room = token_for();
    named.rights.name = text;
    of_room.rights.rooms = {text};
    CHECK_FALSE(is_good(named));
    CHECK_FALSE(is_good(of_room));
  }
}

TEST_CASE("no other issuer, station or server, and no changed bit or length, makes a token good") {
  const auto good = signed_by(kIssuerSeed, kStrangerSeed);
  const std::vector<PublicKey> issuers{issuer_of(issuer_secret(kIssuerSeed))};
  const PublicKey station = public_of(secret_of(kStrangerSeed)), other = public_of(secret_of(kStationSeed));
  REQUIRE(verify_token(good, issuers, server_key(), station));
  CHECK_FALSE(verify_token(good, issuers, server_key(), other));
  CHECK_FALSE(verify_token(good, issuers, other, station));
  CHECK_FALSE(verify_token(signed_by(kOtherIssuerSeed, kStrangerSeed), issuers, server_key(), station));
  CHECK_FALSE(verify_token(good, {}, server_key(), station));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    INFO("bit " << bit);
    REQUIRE_FALSE(verify_token(bad, issuers, server_key(), station));
  }
  for (std::size_t size = 0; size < good.size(); ++size)
    REQUIRE_FALSE(verify_token(std::span(good).first(size), issuers, server_key(), station));
}

TEST_CASE("a stolen token is of no use with another key") {
  ClientKeys thief = client_keys(77);
  thief.token = signed_by(kIssuerSeed, kStrangerSeed);
  ChannelPair pair(site_with_issuer(), thief);
  CHECK(pair.join() == 0);
  CHECK(pair.server.counts().of(ChannelFault::token) == 1);
}

TEST_CASE("a token that came too late lets nobody in") {
  ChannelPair pair(site_with_issuer(), stranger_with(signed_by(kIssuerSeed, kStrangerSeed)));
  pair.unix_s = kNow + 60;
  CHECK(pair.shake_hands());
  ChannelPair late(site_with_issuer(), stranger_with(signed_by(kIssuerSeed, kStrangerSeed)));
  late.unix_s = kNow + 61;
  CHECK_FALSE(late.shake_hands());
  CHECK(late.server.counts().of(ChannelFault::token_expired) == 1);
}

TEST_CASE("a token opens one session, and its new keys are the same session, long after the token's time to join") {
  const ClientKeys keys = stranger_with(signed_by(kIssuerSeed, kStrangerSeed));
  ChannelPair pair(site_with_issuer(), keys);
  const ChannelPeer peer = pair.join();
  REQUIRE(peer != 0);
  pair.now += Micros{120'000'000};
  pair.unix_s += 120;
  REQUIRE(pair.join() == peer);
  CHECK(pair.client.counts().handshakes == 2);
  pair.unix_s = kNow + 30;  // as if the clock had been set back: a used token stays used
  new_life(pair, keys, 55);
  CHECK(pair.join() == 0);
  CHECK(pair.server.counts().of(ChannelFault::token_used) == 1);
}

TEST_CASE("a token for two streams opens two sessions, not three") {
  const ClientKeys keys = stranger_with(signed_by(kIssuerSeed, kStrangerSeed, token_for(2)));
  ChannelPair pair(site_with_issuer(), keys);
  CHECK(pair.join() != 0);
  new_life(pair, keys, 56);
  CHECK(pair.join() != 0);
  new_life(pair, keys, 57);
  CHECK(pair.join() == 0);
}

TEST_CASE("a session by token ends when the token says so, and a clock on the wall that is set changes nothing about it") {
  Token token = token_for();
  token.session_s = 100;
  for (const std::int64_t set_s : {0, 86'400, -86'400}) {
    ChannelPair pair(site_with_issuer(), stranger_with(signed_by(kIssuerSeed, kStrangerSeed, token)));
    const ChannelPeer peer = pair.join();
    const Micros joined = pair.now;
    pair.unix_s += set_s;
    pair.now = joined + Micros{99'900'000};
    pair.server.tick(pair.now);
    INFO("set by " << set_s << " s");
    CHECK(pair.server.take_ended().empty());
    pair.now = joined + Micros{100'200'000};
    pair.server.tick(pair.now);
    CHECK(pair.server.take_ended() == std::vector<ChannelPeer>{peer});
  }
}

TEST_CASE("a session by token that is over does not begin anew, however often its client asks while the token may still join") {
  Token token = token_for();
  token.session_s = 10;
  ChannelPair pair(site_with_issuer(), stranger_with(signed_by(kIssuerSeed, kStrangerSeed, token)));
  REQUIRE(pair.join() != 0);
  pair.now += Micros{10'300'000};
  pair.unix_s += 10;
  pair.server.tick(pair.now);
  for (const ChannelPeer peer : pair.server.take_ended()) pair.server.forget(peer);
  REQUIRE(pair.server.sessions() == 0);
  for (int k = 0; k < 5; ++k) {
    pair.to_server(pair.sealed("still here"));
    for (const Datagram& hint : pair.from_server()) pair.to_client(hint);
    CHECK(pair.join() == 0);
    pair.now += Micros{1'000'000};
  }
  CHECK(pair.server.sessions() == 0);
  CHECK(pair.server.counts().of(ChannelFault::token_used) > 0);
}

TEST_CASE("a token that was used stays used while the clock on the wall is set forwards and back") {
  const ClientKeys keys = stranger_with(signed_by(kIssuerSeed, kStrangerSeed));
  ChannelPair pair(site_with_issuer(), keys);
  REQUIRE(pair.join() != 0);
  for (const std::int64_t set_s : {7 * 86'400, 0}) {
    pair.unix_s = kNow + set_s;
    pair.now += Micros{1'000'000};
    pair.server.tick(pair.now);
  }
  new_life(pair, keys, 55);
  CHECK(pair.join() == 0);
  CHECK(pair.server.counts().of(ChannelFault::token_used) == 1);
}

TEST_CASE("an issuer that is taken out ends the sessions of its tokens") {
  SiteKeys site = site_with_issuer();
  ChannelPair pair(site, stranger_with(signed_by(kIssuerSeed, kStrangerSeed)));
  const ChannelPeer peer = pair.join();
  site.issuers.clear();
  pair.server.change_keys(site);
  CHECK(pair.server.take_ended() == std::vector<ChannelPeer>{peer});
}
