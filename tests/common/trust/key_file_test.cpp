#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

const std::string kSelf = "self " + to_text(Bytes(secret_of(kServerSeed).bytes)) + "\n";
std::string key_text(std::uint64_t seed) { return to_text(public_of(secret_of(seed))); }

std::string error_of(const std::string& text) {
  try {
    parse_keys(text, "site.keys");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a key file says who is who and who may do what") {
  IssuerSecret issuer;
  issuer.bytes = secret_of(5).bytes;
  const std::string text = "# the site\n" + kSelf + "\n\tstation " + key_text(kStationSeed) +
                           " \"OR 3\" hand,viewer room=liver room=\"left lung\" kbit_s=500 streams=2  # by the window\n" +
                           "station " + key_text(kStrangerSeed) + " desk viewer\nissuer " + to_text(issuer_of(issuer)) +
                           "\nserver " + key_text(9) + "\n";
  const KeyFile keys = parse_keys(text, "site.keys");
  REQUIRE(keys.self);
  CHECK(public_of(*keys.self) == public_of(secret_of(kServerSeed)));
  REQUIRE(keys.stations.size() == 2);
  const Rights& first = keys.stations.at(public_of(secret_of(kStationSeed)));
  CHECK(first == Rights{"OR 3", true, true, {"liver", "left lung"}, 500, 2});
  CHECK(keys.stations.at(public_of(secret_of(kStrangerSeed))) == Rights{"desk", false, true, {}, kKbitUsual, kStreamsUsual});
  CHECK(keys.issuers == std::vector<PublicKey>{issuer_of(issuer)});
  CHECK(keys.server == public_of(secret_of(9)));
}

TEST_CASE("a line for a station is read as the rights that it was written for") {
  const Rights rights{"left \xc3\xa4 3", true, false, {"a b", "c"}, 77, 5};
  const PublicKey key = public_of(secret_of(kStationSeed));
  CHECK(parse_keys(station_line(key, rights), "x").stations.at(key) == rights);
}

TEST_CASE("roles are a list without order, a guide needs a hand, and a writer of notes a viewer") {
  Rights rights;
  CHECK(read_roles("viewer,note,guide,hand", rights));
  CHECK((rights.hand && rights.viewer && rights.guide && rights.note));
  const PublicKey key = public_of(secret_of(kStationSeed));
  rights.name = "OR 3";
  CHECK(parse_keys(station_line(key, rights), "x").stations.at(key) == rights);
  CHECK(read_roles("viewer", rights));
  CHECK_FALSE((rights.hand || rights.guide || rights.note));
  CHECK(read_roles("viewer,note", rights));
  CHECK((rights.viewer && rights.note));
  for (const char* const wrong :
       {"", "guide", "viewer,guide", "note", "hand,note", "hand,hand", "hand,", ",hand", "hand viewer", "hand,surgeon"})
    CHECK_FALSE(read_roles(wrong, rights));
}

TEST_CASE("what is wrong in a key file is said with its line and what was expected") {
  const std::string station = "station " + key_text(kStationSeed);
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"\nself\n", "site.keys:2: the line ends too early; expected 44 characters"},
      {kSelf + kSelf, "site.keys:2: a second self; expected one"},
      {"\n\nstation abc \"x\" hand\n", "site.keys:3: \"abc\" is no key; expected 44 characters"},
      {station + " \"OR 3\" surgeon", "site.keys:1: \"surgeon\" is no role; expected hand, viewer, or hand,viewer"},
      {station + " \"OR 3 hand", "site.keys:1: a \" is not closed"},
      {station + " a hand streams=0", "site.keys:1: streams is \"0\"; expected a whole number from 1 to 64"},
      {station + " a hand kbit=5", "site.keys:1: \"kbit=5\" limits nothing; expected room=NAME, kbit_s=N or streams=N"},
      {station + " a hand\nstation " + key_text(8) + " a-2 hand", "site.keys:2: \"a-2\" and \"a\" could have the same name"},
      {station + " a hand\n" + station + " b hand", "site.keys:2: this key is there already"},
      {station + " M\xfcller hand",
       "site.keys:1: the name \"M?ller\"; expected 1 to 64 bytes of UTF-8 without control characters"},
      {station + " c\xe2\x82 hand", "site.keys:1: the name \"c??\"; expected 1 to 64 bytes of UTF-8"},
      {station + " \"a\xc2\x9b\" hand", "site.keys:1: the name \"a?\"; expected 1 to 64 bytes of UTF-8"},
      {station + " a hand room=\xff", "site.keys:1: room is \"?\"; expected up to 16 names"},
      {std::string("sta\0tion\x1b[2J", 12), "site.keys:1: \"sta?tion?[2J\" is unknown; expected self"},
      {"server " + key_text(8) + " x", "site.keys:1: \"x\" is too much; expected the end of the line"},
      {"stations", "site.keys:1: \"stations\" is unknown; expected self, server, station, issuer or issuer-self"},
      {"issuer " + to_text(PublicKey{}), "site.keys:1: this is no issuer's key"},
  };
  for (const auto& [text, said] : wrong) {
    INFO(text);
    CHECK(error_of(text).starts_with(said));
  }
}

TEST_CASE("a secret that cannot be read does not appear in the error") {
  const std::string secret = to_text(Bytes(secret_of(4).bytes)).substr(0, 40);
  const std::string said = error_of("self " + secret);
  CHECK(said.starts_with("site.keys:1: the secret is no key"));
  CHECK(said.find(secret) == std::string::npos);
}

TEST_CASE("a server's file wants a key and somebody to let in, a station's a key and a server") {
  const std::string station = "station " + key_text(kStationSeed) + " a hand\n";
  CHECK_NOTHROW(site_of(parse_keys(kSelf + station, "f"), "f"));
  CHECK_THROWS_AS(site_of(parse_keys(station, "f"), "f"), InputError);
  CHECK_THROWS_AS(site_of(parse_keys(kSelf, "f"), "f"), InputError);
  CHECK_NOTHROW(client_of(parse_keys(kSelf + "server " + key_text(1), "f"), "f"));
  CHECK_THROWS_AS(client_of(parse_keys(kSelf, "f"), "f"), InputError);
}

TEST_CASE("pinning a server changes that line and no other") {
  const std::string text = "# mine\n" + kSelf;
  const std::string once = with_server(text, public_of(secret_of(1)));
  CHECK(once == text + "server " + key_text(1) + "\n");
  CHECK(with_server(once, public_of(secret_of(2))) == text + "server " + key_text(2) + "\n");
}

TEST_CASE("a name belongs to a key with what is behind - or /, and nothing else") {
  const Rights rights = rights_of("OR 3");
  for (const char* name : {"OR 3", "OR 3-2", "OR 3/port"}) CHECK(rights.has_name(name));
  for (const char* name : {"OR 30", "OR", "", "or 3", "OR 3 -2"}) CHECK_FALSE(rights.has_name(name));
}

TEST_CASE("of text that is no token nothing is taken") {
  const std::vector<std::uint8_t> bytes{1, 2, 3};
  CHECK(parse_token(to_text(Bytes(bytes)) + "\n", "t") == bytes);
  for (const char* text : {"", "\n", "no token", "AQI"}) CHECK_THROWS_AS(parse_token(text, "t"), InputError);
}

TEST_CASE(
    "the keyed hash gives what the authors of SipHash-2-4 give for key 00 .. 0f and messages 00 .. 0e of every length that "
    "matters") {
  constexpr HashKey key{0x0706050403020100ull, 0x0f0e0d0c0b0a0908ull};
  std::array<std::uint8_t, 15> message{};
  for (std::size_t k = 0; k < message.size(); ++k) message[k] = static_cast<std::uint8_t>(k);
  const auto of = [&](std::size_t bytes) { return keyed_hash(key, Bytes(message).first(bytes)); };
  CHECK(of(0) == 0x726fdb47dd0e0e31ull);
  CHECK(of(1) == 0x74f839c593dc67fdull);
  CHECK(of(8) == 0x93f5f5799a932462ull);
  CHECK(of(15) == 0xa129ca6149be45e5ull);
}
